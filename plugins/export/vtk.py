"""Legacy VTK."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from polycube.registry import register
from polycube.types import HexMesh

from .format import TextFormat, WithNodes
from .groups import node_sets, renamed
from .text import EXACT, lines

NAME = 200  # longest name; readers allow 255 characters
KINDS = {8: 12, 20: 25, 27: 29}  # cell types of hexahedra


@register("export", "vtk")
@dataclass(frozen=True)
class LegacyVtk(WithNodes, TextFormat):
    """Legacy VTK, ASCII (.vtk), read by many research codes: an array per boundary set.

    The array of a set is 1 at its nodes, and at hexes the sum of 1, 2, 4, 8, 16, 32 for its sides
    -xi +xi -eta +eta -zeta +zeta in the set.
    """

    suffix: ClassVar[str] = ".vtk"

    def parts(self, hexes: HexMesh) -> list[str]:
        """The text of the file, in parts."""
        from polycube.hexmesh.scaled_jacobian import scaled_jacobian
        from polycube.io.vtk import numbered_primitives, set_arrays

        n, own = len(hexes.hexes), self.elements(hexes)
        hexes = renamed(hexes, NAME)
        names, primitive = numbered_primitives(hexes.primitives)
        legend = ", ".join(f"{i} {name}" for i, name in enumerate(names))
        unit = f", lengths in {hexes.unit}" if hexes.unit else ""
        title = f"hex mesh of polycube{unit}{'; primitive: ' if names else ''}{legend}"[:255]
        numbers, sets = np.arange(len(own.points)), node_sets(hexes, own.quads)
        shown = [name for name in sets if not name.startswith("patch_")]
        at_nodes = {name: np.isin(numbers, sets[name]).astype(int) for name in shown}
        of_hexes = {"cell": hexes.cell}
        if names:
            of_hexes["primitive"] = primitive[hexes.cell]
        of_hexes |= set_arrays(hexes)[1]
        quality = scaled_jacobian(hexes.vertices, hexes.hexes)
        return [
            f"# vtk DataFile Version 3.0\n{title}\nASCII\nDATASET UNSTRUCTURED_GRID\n",
            f"POINTS {len(own.points)} double\n",
            lines(own.points, EXACT),
            f"CELLS {n} {(1 + self.nodes) * n}\n",
            lines(np.insert(own.hexes, 0, self.nodes, axis=1)),
            f"CELL_TYPES {n}\n" + f"{KINDS[self.nodes]}\n" * n,
            f"POINT_DATA {len(own.points)}\n",
            *(_scalars(name, "int", lines(own[:, None])) for name, own in at_nodes.items()),
            f"CELL_DATA {n}\n",
            *(_scalars(name, "int", lines(own[:, None])) for name, own in of_hexes.items()),
            _scalars("scaled_jacobian", "double", lines(quality[:, None], EXACT)),
        ]


def _scalars(name: str, kind: str, values: str) -> str:
    return f"SCALARS {name} {kind} 1\nLOOKUP_TABLE default\n{values}"
