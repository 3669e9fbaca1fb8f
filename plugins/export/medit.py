"""Medit."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from polycube.registry import register
from polycube.types import HexMesh

from .format import TextFormat
from .groups import blocks, legend, side_sets
from .text import EXACT, lines


@register("export", "medit")
@dataclass(frozen=True)
class Medit(TextFormat):
    """Medit, ASCII (.mesh): references are patches and grid cells, with names as comments.

    The comments are after the end of the data, where they do not disturb readers.
    """

    suffix: ClassVar[str] = ".mesh"

    def parts(self, hexes: HexMesh) -> list[str]:
        """The text of the file, in parts."""
        flat = np.zeros((len(hexes.vertices), 1))
        return [
            f"MeshVersionFormatted 2\nDimension 3\nVertices\n{len(flat)}\n",
            lines(np.hstack([hexes.vertices, flat]), EXACT),
            f"Quadrilaterals\n{len(hexes.quads)}\n",
            lines(np.column_stack([hexes.quads + 1, hexes.patch])),
            f"Hexahedra\n{len(hexes.hexes)}\n",
            lines(np.column_stack([hexes.hexes + 1, hexes.cell])),
            "End\n",
            *_legend(hexes),
        ]


def _legend(mesh: HexMesh) -> list[str]:
    """Names of references for sets of whole patches; lists of quads, from one, for other sets."""
    rows = [legend(mesh, "# ")]
    for name, quads in side_sets(mesh).items():
        own = np.unique(mesh.patch[quads])
        is_patches = np.isin(mesh.patch, own).sum() == len(quads)
        what = "references" if is_patches else "numbers"
        listed = " ".join(map(str, own if is_patches else quads + 1))
        rows.append(f"# {name}: quadrilaterals with {what} {listed}\n")
    cells = {name: mesh.cell[own[0]] for name, own in blocks(mesh).items()}
    return rows + [f"# {name}: hexahedra with reference {cell}\n" for name, cell in cells.items()]
