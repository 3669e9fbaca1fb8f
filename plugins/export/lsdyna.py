"""LS-DYNA keywords."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from polycube.registry import register
from polycube.types import HexMesh

from .groups import blocks, legend, node_sets, primitive_sets, renamed, side_sets
from .text import count, lines, wrapped, write

TITLE = 80  # longest title


@register("export", "lsdyna")
@dataclass(frozen=True)
class LsDyna:
    """LS-DYNA keywords (.k): a part for each grid cell, named sets of nodes, segments, parts.

    Parts have no section and no material; these are defined in the file that includes this one.
    """

    suffix: ClassVar[str] = ".k"

    def __call__(self, hexes: HexMesh, path: Path) -> Path:
        """Write a file at `path`, with the suffix of this format, and return its path."""
        elements = count(np.column_stack([hexes.cell + 1, hexes.hexes + 1]))
        hexes = renamed(hexes, TITLE)
        parts = ["*KEYWORD\n", legend(hexes, "$ ")]
        parts += [f"$ part {hexes.cell[own[0]] + 1}: {n}\n" for n, own in blocks(hexes).items()]
        parts += ["*NODE\n", lines(count(hexes.vertices), "%8d" + 3 * "%16.9E")]
        parts += ["*ELEMENT_SOLID\n", lines(elements, 10 * "%8d")]
        for k, (name, own) in enumerate(node_sets(hexes).items(), start=1):
            parts.append(_set("NODE_LIST", name, k) + wrapped(own + 1, 8, "%10d"))
        for k, (name, own) in enumerate(side_sets(hexes).items(), start=1):
            parts.append(_set("SEGMENT", name, k) + lines(hexes.quads[own] + 1, 4 * "%10d"))
        for k, (name, own) in enumerate(primitive_sets(hexes).items(), start=1):
            cells = np.unique(hexes.cell[own]) + 1
            parts.append(_set("PART_LIST", name, k) + wrapped(cells, 8, "%10d"))
        return write(path.with_suffix(self.suffix), *parts, "*END\n")


def _set(kind: str, name: str, number: int) -> str:
    return f"*SET_{kind}_TITLE\n{name}\n{number:10d}\n"
