"""Nastran bulk data."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from polycube.registry import register
from polycube.types import HexMesh

from .groups import blocks, node_sets, primitive_sets, side_sets
from .text import count, lines, write

GRID = "GRID*   %16d                %16.9E%16.9E\n*       %16.9E"
CHEXA = "CHEXA   " + 8 * "%8d" + "\n+       " + 2 * "%8d"
PLOAD4 = "PLOAD4  %8d%8d      1." + 24 * " " + 2 * "%8d"


@register("export", "nastran")
@dataclass(frozen=True)
class Nastran:
    """Nastran bulk data (.bdf): CHEXA; a property per grid cell, SET1 and PLOAD4 per boundary set.

    Each set of the boundary is a SET1 of nodes and unit pressures PLOAD4 with the same number; each
    primitive is a SET1 of elements. A comment before each contains its name. Material 1 must be
    added by the user.
    """

    suffix: ClassVar[str] = ".bdf"

    def __call__(self, hexes: HexMesh, path: Path) -> Path:
        """Write a file at `path`, with the suffix of this format, and return its path."""
        from polycube.hexmesh.connectivity import quad_sides

        owner, _ = quad_sides(hexes)
        parts = ["SOL 101\nCEND\nTITLE = hex mesh of polycube\nBEGIN BULK\n"]
        for name, own in blocks(hexes).items():
            number = hexes.cell[own[0]] + 1
            parts.append(f"$ property {number}: {name}\nPSOLID  {number:8d}       1\n")
        parts.append(lines(count(hexes.vertices), GRID))
        parts.append(lines(count(np.column_stack([hexes.cell + 1, hexes.hexes + 1])), CHEXA))
        nodes, sides = node_sets(hexes), side_sets(hexes)
        for k, name in enumerate(sides, start=1):
            parts.append(f"$ set {k}, nodes: {name}\n{_set(k, nodes[name])}")
        for k, (name, own) in enumerate(primitive_sets(hexes).items(), start=1 + len(sides)):
            parts.append(f"$ set {k}, elements: {name}\n{_set(k, own)}")
        for k, (name, quads) in enumerate(sides.items(), start=1):
            corners = hexes.quads[quads][:, [0, 2]] + 1
            loads = np.column_stack([np.full(len(quads), k), owner[quads] + 1, corners])
            parts.append(f"$ load {k}, pressure 1 on faces: {name}\n{lines(loads, PLOAD4)}")
        return write(path.with_suffix(self.suffix), *parts, "ENDDATA\n")


def _set(number: int, own: np.ndarray) -> str:
    """A SET1 of nodes or elements: seven in the first line, then eight."""
    fields = [f"{n:8d}" for n in (number, *(own + 1).tolist())]
    rows = ["".join(fields[i : i + 8]) for i in range(0, len(fields), 8)]
    return "SET1    " + "\n+       ".join(rows) + "\n"
