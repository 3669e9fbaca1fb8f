"""Named sets of boundary quads, nodes and hexes, the same in all formats."""

from __future__ import annotations

import numpy as np

from polycube.types import HexMesh


def side_sets(mesh: HexMesh) -> dict[str, np.ndarray]:
    """Numbers of boundary quads by name: x_min etc., hole_1 etc., cad_face_1 etc., patch_0 etc."""
    from polycube.hexmesh.named_sets import boundary_sets

    return dict(mesh.sets) or boundary_sets(mesh)


def node_sets(mesh: HexMesh, quads: np.ndarray | None = None) -> dict[str, np.ndarray]:
    """Numbers of the nodes on the quads of each set, ascending.

    quads : (Q, n) nodes of each quad, if there are more than the vertices of the mesh
    """
    nodes = mesh.quads if quads is None else quads
    return {name: np.unique(nodes[own]) for name, own in side_sets(mesh).items()}


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
    """Hexes of each primitive, such as primitive_hole_z; empty if primitives are unknown."""
    from polycube.io.vtk import numbered_primitives

    names, primitive = numbered_primitives(mesh.primitives)
    return {
        f"primitive_{name}": np.flatnonzero(primitive[mesh.cell] == k)
        for k, name in enumerate(names)
    }
