"""Medit."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from polycube.registry import register
from polycube.types import HexMesh

from .groups import blocks, legend, side_sets
from .text import floats, integers, write


@register("export", "medit")
@dataclass(frozen=True)
class Medit:
    """Medit, ASCII (.mesh): references are patches and grid cells, with names as comments.

    The comments are after the end of the data, where they do not disturb readers.
    """

    suffix: ClassVar[str] = ".mesh"

    def __call__(self, hexes: HexMesh, path: Path) -> Path:
        """Write a file at `path`, with the suffix of this format, and return its path."""
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
    """Names of references for sets of whole patches; lists of quads, from one, for other sets."""
    rows = [legend(mesh, "# ")]
    for name, quads in side_sets(mesh).items():
        own = np.unique(mesh.patch[quads])
        is_patches = np.isin(mesh.patch, own).sum() == len(quads)
        what = "references" if is_patches else "numbers"
        listed = " ".join(map(str, own if is_patches else quads + 1))
        rows.append(f"# {name}: quadrilaterals with {what} {listed}\n")
    rows += [
        f"# {name}: hexahedra with reference {mesh.cell[own[0]]}\n"
        for name, own in blocks(mesh).items()
    ]
    return rows
