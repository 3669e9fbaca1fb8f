"""Gmsh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from polycube.registry import register
from polycube.types import HexMesh

from .format import TextFormat, WithNodes
from .groups import blocks, first_sets, legend, primitive_sets, renamed, side_sets
from .text import EXACT, count, lines

if TYPE_CHECKING:
    from polycube.spline.second_order import HexElements

NAME = 127  # longest name
KINDS = {8: (3, 5), 20: (16, 17), 27: (10, 12)}  # element types of quads and hexahedra
# order of the nodes of a hexahedron; edges and faces differ from VTK
EDGES = np.array([0, 3, 8, 1, 9, 2, 10, 11, 4, 7, 5, 6]) + 8
FACES = np.array([4, 2, 0, 1, 3, 5]) + 20
ORDER = np.concatenate([np.arange(8), EDGES, FACES, [26]])


@register("export", "gmsh")
@dataclass(frozen=True)
class Gmsh(WithNodes, TextFormat):
    """Gmsh, ASCII (.msh): a physical group for each grid cell and boundary set.

    Parameters
    ----------
    version : 4.1 has all groups of each element; 2.2, for older programs, has one group for each:
        the first set of a quad, the grid cell of a hex
    """

    version: Literal["2.2", "4.1"] = "4.1"

    suffix: ClassVar[str] = ".msh"

    def parts(self, hexes: HexMesh) -> list[str]:
        """The text of the file, in parts."""
        own = self.elements(hexes)
        hexes = renamed(hexes, NAME, ascii_only=False)
        comment = f"$Comments\n{legend(hexes).replace('$', 'S')}$EndComments\n"
        is_simple = str(self.version) == "2.2"
        parts = _in_one_group(hexes, own) if is_simple else _in_all_groups(hexes, own)
        return [f"$MeshFormat\n{self.version} 0 8\n$EndMeshFormat\n{comment}", *parts]


def _in_one_group(mesh: HexMesh, own: HexElements) -> list[str]:
    """Format 2.2 after its first line."""
    surfaces, of_quad = first_sets(mesh)
    volumes = blocks(mesh)
    of_hex = np.searchsorted(np.unique(mesh.cell), mesh.cell)
    nodes = own.hexes.shape[1]
    quad, hexahedron = KINDS[nodes]
    quads = _tagged(quad, of_quad, own.quads, 1)
    hexes = _tagged(hexahedron, of_hex, own.hexes[:, ORDER[:nodes]], 1 + len(quads))
    return [
        _names(surfaces, list(volumes)),
        f"$Nodes\n{len(own.points)}\n",
        lines(count(own.points), "%d" + 3 * " %.17g"),
        f"$EndNodes\n$Elements\n{len(quads) + len(hexes)}\n",
        lines(quads),
        lines(hexes),
        "$EndElements\n",
    ]


def _tagged(kind: int, group: np.ndarray, nodes: np.ndarray, first: int) -> np.ndarray:
    """Rows of an element: number, kind, two tags (physical, elementary), nodes from one."""
    numbers = np.arange(first, first + len(nodes))
    tags = np.column_stack([numbers, np.full_like(numbers, kind), np.full_like(numbers, 2)])
    return np.column_stack([tags, group + 1, group + 1, nodes + 1])


def _in_all_groups(mesh: HexMesh, own: HexElements) -> list[str]:
    """Format 4.1 after its first line: an entity for each combination of groups.

    A block has consecutive elements of one entity, so the order of the elements is that of the
    mesh.
    """
    surfaces, volumes = side_sets(mesh), blocks(mesh) | primitive_sets(mesh)
    every = np.arange(len(mesh.quads))
    if len(np.setdiff1d(every, np.concatenate([[], *surfaces.values()]))):
        surfaces["boundary"] = every  # meshio needs a group for every element
    low, high = own.points.min(axis=0), own.points.max(axis=0)
    box = " ".join(f"{x:.17g}" for x in (*low, *high))
    n_points, nodes = len(own.points), own.hexes.shape[1]
    elements = (own.quads, own.hexes[:, ORDER[:nodes]])
    entities, counts, rows = [], [], []
    for k, sets in enumerate((surfaces, volumes)):
        every = np.arange(len(elements[k]))
        members = [np.isin(every, own_rows) for own_rows in sets.values()]
        groups, which = np.unique(members, axis=1, return_inverse=True)
        counts.append(groups.shape[1])
        for tag, group in enumerate(groups.T, start=1):
            own_tags = np.flatnonzero(group) + 1
            tags = " ".join(map(str, own_tags))
            entities.append(f"{tag} {box} {len(own_tags)} {tags} 0\n")
        table = np.column_stack([1 + k * len(elements[0]) + every, elements[k] + 1])
        for run in np.split(every, 1 + np.flatnonzero(np.diff(which.ravel()))):
            head = f"{2 + k} {1 + which.ravel()[run[0]]} {KINDS[nodes][k]} {len(run)}\n"
            rows.append(head + lines(table[run]))
    n_elements = sum(map(len, elements))
    return [
        _names(list(surfaces), list(volumes)),
        f"$Entities\n0 0 {counts[0]} {counts[1]}\n",
        *entities,
        f"$EndEntities\n$Nodes\n1 {n_points} 1 {n_points}\n3 1 0 {n_points}\n",
        lines(count(own.points)[:, :1]),
        lines(own.points, EXACT),
        f"$EndNodes\n$Elements\n{len(rows)} {n_elements} 1 {n_elements}\n",
        *rows,
        "$EndElements\n",
    ]


def _names(surfaces: list[str], volumes: list[str]) -> str:
    rows = [f'2 {k} "{name}"\n' for k, name in enumerate(surfaces, start=1)]
    rows += [f'3 {k} "{name}"\n' for k, name in enumerate(volumes, start=1)]
    return f"$PhysicalNames\n{len(rows)}\n{''.join(rows)}$EndPhysicalNames\n"
