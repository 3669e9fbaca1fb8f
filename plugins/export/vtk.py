"""Legacy VTK."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

import numpy as np

from polycube.registry import BY_RUN, register
from polycube.types import HexMesh, Spline

from .groups import node_sets, renamed
from .text import floats, integers, write

NAME = 200  # longest name; readers allow 255 characters
KINDS = {8: 12, 20: 25, 27: 29}  # cell types of hexahedra


@register("export", "vtk")
@dataclass(frozen=True)
class LegacyVtk:
    """Legacy VTK, ASCII (.vtk), read by many research codes: an array per boundary set.

    The array of a set is 1 at its nodes, and at hexes the sum of 1, 2, 4, 8, 16, 32 for its sides
    -xi +xi -eta +eta -zeta +zeta in the set.

    Parameters
    ----------
    nodes : number of nodes of a hex: 8, 20 or 27; the additional nodes are on the spline if there
        is one
    """

    nodes: int = 8
    spline: Spline | None = field(default=None, metadata=BY_RUN)

    def __post_init__(self) -> None:
        from polycube.spline.second_order import check_nodes

        check_nodes(self.nodes)

    suffix: ClassVar[str] = ".vtk"

    def __call__(self, hexes: HexMesh, path: Path) -> Path:
        """Write a file at `path`, with the suffix of this format, and return its path."""
        from polycube.hexmesh.scaled_jacobian import scaled_jacobian
        from polycube.io.vtk import numbered_primitives, set_arrays
        from polycube.spline.second_order import hex_elements

        n, own = len(hexes.hexes), hex_elements(hexes, self.spline, self.nodes)
        hexes = renamed(hexes, NAME)
        names, primitive = numbered_primitives(hexes.primitives)
        legend = ", ".join(f"{i} {name}" for i, name in enumerate(names))
        unit = f", lengths in {hexes.unit}" if hexes.unit else ""
        title = f"hex mesh of polycube{unit}{'; primitive: ' if names else ''}{legend}"[:255]
        _, at_hexes = set_arrays(hexes)
        at_nodes = {
            name: np.isin(np.arange(len(own.points)), nodes).astype(int)
            for name, nodes in node_sets(hexes, own.quads).items()
            if not name.startswith("patch_")
        }
        of_hexes = {"cell": hexes.cell}
        if names:
            of_hexes["primitive"] = primitive[hexes.cell]
        quality = scaled_jacobian(hexes.vertices, hexes.hexes)
        return write(
            path.with_suffix(self.suffix),
            f"# vtk DataFile Version 3.0\n{title}\nASCII\nDATASET UNSTRUCTURED_GRID\n",
            f"POINTS {len(own.points)} double\n",
            floats(own.points),
            f"CELLS {n} {(1 + self.nodes) * n}\n",
            integers(np.insert(own.hexes, 0, self.nodes, axis=1)),
            f"CELL_TYPES {n}\n" + f"{KINDS[self.nodes]}\n" * n,
            f"POINT_DATA {len(own.points)}\n",
            *(_scalars(name, "int", integers(own[:, None])) for name, own in at_nodes.items()),
            f"CELL_DATA {n}\n",
            *(
                _scalars(name, "int", integers(own[:, None]))
                for name, own in (of_hexes | at_hexes).items()
            ),
            _scalars("scaled_jacobian", "double", floats(quality[:, None])),
        )


def _scalars(name: str, kind: str, values: str) -> str:
    return f"SCALARS {name} {kind} 1\nLOOKUP_TABLE default\n{values}"
