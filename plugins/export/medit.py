"""Medit."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from polycube.registry import register
from polycube.types import HexMesh

from .groups import blocks, side_sets
from .text import floats, integers, write


@register("export", "medit")
@dataclass(frozen=True)
class Medit:
    """Medit, ASCII (.mesh): references are patches and grid cells, with names as comments.

    The comments stand after the end of the data, where no reader expects any.
    """

    suffix: ClassVar[str] = ".mesh"

    def __call__(self, hexes: HexMesh, path: Path) -> Path:
        """Write next to `path`, with this format's suffix; returns the file written."""
        flat = np.zeros((len(hexes.vertices), 1))
        return write(
            path.with_suffix(self.suffix),
            f"MeshVersionFormatted 2\nDimension 3\nVertices\n{len(flat)}\n",
            floats(np.hstack([hexes.vertices, flat])),
            f"Quadrilaterals\n{len(hexes.quads)}\n",
            integers(np.column_stack([hexes.quads + 1, hexes.patch])),
            f"Hexahedra\n{len(hexes.hexes)}\n",
            integers(np.column_stack([hexes.hexes + 1, hexes.cell])),
            "End\n",
            *_legend(hexes),
        )


def _legend(mesh: HexMesh) -> list[str]:
    """Sets that are whole patches by their references, others by their quads, from one."""
    rows = []
    for name, quads in side_sets(mesh).items():
        own = np.unique(mesh.patch[quads])
        whole = np.isin(mesh.patch, own).sum() == len(quads)
        what = "references" if whole else "numbers"
        listed = " ".join(map(str, own if whole else quads + 1))
        rows.append(f"# {name}: quadrilaterals with {what} {listed}\n")
    rows += [
        f"# {name}: hexahedra with reference {mesh.cell[own[0]]}\n"
        for name, own in blocks(mesh).items()
    ]
    return rows
