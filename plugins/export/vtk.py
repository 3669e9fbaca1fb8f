"""Legacy VTK."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from polycube.registry import register
from polycube.types import HexMesh

from .text import floats, integers, write


@register("export", "vtk")
@dataclass(frozen=True)
class LegacyVtk:
    """Legacy VTK, ASCII (.vtk), which research codes read: an array per boundary set.

    An array per set: 1 at its nodes; at hexes the sum of 1, 2, 4, 8, 16, 32 for its sides -xi +xi
    -eta +eta -zeta +zeta in the set.
    """

    suffix: ClassVar[str] = ".vtk"

    def __call__(self, hexes: HexMesh, path: Path) -> Path:
        """Write next to `path`, with this format's suffix; returns the file written."""
        from polycube.hexmesh.scaled_jacobian import scaled_jacobian
        from polycube.io.vtk import numbered_primitives, set_arrays

        n = len(hexes.hexes)
        names, primitive = numbered_primitives(hexes.primitives)
        legend = ", ".join(f"{i} {name}" for i, name in enumerate(names))
        title = f"hex mesh of polycube{'; primitive: ' if names else ''}{legend}"[:255]
        at_nodes, at_hexes = set_arrays(hexes)
        of_hexes = {"cell": hexes.cell}
        if names:
            of_hexes["primitive"] = primitive[hexes.cell]
        quality = scaled_jacobian(hexes.vertices, hexes.hexes)
        return write(
            path.with_suffix(self.suffix),
            f"# vtk DataFile Version 3.0\n{title}\nASCII\nDATASET UNSTRUCTURED_GRID\n",
            f"POINTS {len(hexes.vertices)} double\n",
            floats(hexes.vertices),
            f"CELLS {n} {9 * n}\n",
            integers(np.insert(hexes.hexes, 0, 8, axis=1)),
            f"CELL_TYPES {n}\n" + "12\n" * n,
            f"POINT_DATA {len(hexes.vertices)}\n",
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
