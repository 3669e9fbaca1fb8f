"""Named sets of boundary quads, nodes and hexes, the same in all formats."""

import textwrap
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from polycube.names import in_ascii, plain, unique
from polycube.types import HexMesh


def renamed(mesh: HexMesh, length: int, ascii_only: bool = True) -> HexMesh:
    """The mesh with names of sets that a format can hold, in the same order.

    They are unique without regard to case. `cad_names` also has the sets that were renamed.

    length : largest number of bytes of a name
    ascii_only : transliterate other letters
    """

    def called(names: Iterable[str], most: int) -> list[str]:
        return unique(map(in_ascii, names) if ascii_only else names, most)

    sets = side_sets(mesh)
    new, nodes = called(sets, length), called(mesh.node_sets, length)
    renames = dict(zip(sets, new, strict=True))
    pairs = zip((*sets, *mesh.node_sets), (*new, *nodes), strict=True)
    known = mesh.cad_names
    return replace(
        mesh,
        sets={renames[name]: own for name, own in sets.items()},
        node_sets=dict(zip(nodes, mesh.node_sets.values(), strict=True)),
        ties=tuple((renames[a], renames[b]) for a, b in mesh.ties),
        cad_names={b: known.get(a, a) for a, b in pairs if a in known or a != b},
        name=called([plain(mesh.name)], length - len("solid_"))[0],
    )


def legend(mesh: HexMesh, mark: str = "") -> str:
    """Comment lines with the length unit and the table of names, each after a mark."""
    rows = [f"lengths in {mesh.unit or 'the units of the input'}"]
    rows += [f"set {new} is {name!r} in the CAD file" for new, name in mesh.cad_names.items()]
    lines = (line for row in rows for line in textwrap.wrap(row, 70, subsequent_indent="  "))
    return "".join(f"{mark}{line}\n" for line in lines)


def side_sets(mesh: HexMesh) -> dict[str, np.ndarray]:
    """Numbers of boundary quads by name: x_min etc., hole_1 etc., cad_face_1 etc., patch_0 etc."""
    from polycube.hexmesh.named_sets import boundary_sets

    return dict(mesh.sets) or boundary_sets(mesh)


def node_sets(mesh: HexMesh, quads: np.ndarray | None = None) -> dict[str, np.ndarray]:
    """Numbers of the nodes on the quads of each set and of those on named edges, ascending.

    quads : (Q, n) nodes of each quad, if there are more than the vertices of the mesh
    """
    nodes = mesh.quads if quads is None else quads
    found = {name: np.unique(nodes[own]) for name, own in side_sets(mesh).items()}
    return found | dict(mesh.node_sets)


def first_sets(mesh: HexMesh) -> tuple[list[str], np.ndarray]:
    """For formats with one group for each quad: names, and the number (Q,) of its first set."""
    sets = side_sets(mesh)
    number = np.full(len(mesh.quads), len(sets))
    for k, quads in reversed(list(enumerate(sets.values()))):
        number[quads] = k
    used, number = np.unique(number, return_inverse=True)
    return [list(sets)[k] for k in used], number.ravel()


def blocks(mesh: HexMesh) -> dict[str, np.ndarray]:
    """Hexes of each grid cell: cell_0, or cell_0_hole_z if the primitive is known."""
    filled = {c: f"_{name}" for c, name in enumerate(mesh.primitives) if name}
    cells = np.unique(mesh.cell).tolist()
    return {f"cell_{c}{filled.get(c, '')}": np.flatnonzero(mesh.cell == c) for c in cells}


def primitive_sets(mesh: HexMesh) -> dict[str, np.ndarray]:
    """Hexes of each known primitive, such as primitive_hole_z, and of a solid with a name."""
    from polycube.io.vtk import numbered_primitives

    names, primitive = numbered_primitives(mesh.primitives)
    solid = {f"solid_{plain(mesh.name)}": np.arange(len(mesh.hexes))} if mesh.name else {}
    rows = [np.flatnonzero(primitive[mesh.cell] == k) for k in range(len(names))]
    return solid | {f"primitive_{name}": own for name, own in zip(names, rows, strict=True)}
