"""Contexts of a row of cells as patterns of slabs.

Along the row, a polycube is a sequence of slabs: F full, R a ring (the centre removed), Y and Z two
bars (the central z column removed, a hole along y; the central y row removed, a hole along z).
Repeated letters are redundant: cube + hole_y = FFF FYF = FYF. A few patterns thus represent all
contexts, and the structure of a part is found by aligning its slices with each pattern.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from polycube.structure.lattice import collapse, is_manifold, lattice
from polycube.types import Polycube

FULL = np.ones((3, 3), bool)
PATTERNS = {name: FULL.copy() for name in "FRYZ"}  # (y, z)
PATTERNS["R"][1, 1] = False
PATTERNS["Y"][:, 1] = False
PATTERNS["Z"][1, :] = False


@dataclass(frozen=True, eq=False)
class Word:
    """A pattern and the (collapsed) polycubes of all its contexts."""

    letters: str
    polycubes: tuple[Polycube, ...]

    def without_ring(self) -> set[str]:
        """The patterns with one R removed."""
        return {
            _merge(self.letters[:i] + self.letters[i + 1 :])
            for i, letter in enumerate(self.letters)
            if letter == "R" and len(self.letters) > 1
        }


def words(grid: tuple[int, int, int], primitives: Mapping[str, np.ndarray]) -> list[Word]:
    """Patterns of the contexts of an n x 1 x 1 grid, short ones first; the last cells may be empty.

    Primitives with a slab other than F, R, Y, Z have no pattern.
    """
    readable = {name: s for name, voxels in primitives.items() if (s := _spell_cell(voxels))}
    spelled: dict[str, list[Polycube]] = {}
    for n_cells in range(1, grid[0] + 1):
        for cells in itertools.product(readable, repeat=n_cells):
            letters = _merge("".join(readable[name] for name in cells))
            context = cells + (None,) * (grid[0] - n_cells)
            polycube = collapse(lattice(grid, context, primitives))
            if is_manifold(polycube):
                spelled.setdefault(letters, []).append(polycube)
    ordered = sorted(spelled, key=lambda letters: (len(letters), letters))
    return [Word(letters, tuple(spelled[letters])) for letters in ordered]


def spell(context: Sequence[str | None], primitives: Mapping[str, np.ndarray]) -> str:
    """Pattern of a context of a row of cells; "" if a cell has another slab."""
    letters = [_spell_cell(primitives[name]) for name in context if name is not None]
    return _merge("".join(letters)) if all(letters) else ""


def _spell_cell(voxels: np.ndarray) -> str:
    """Three letters of a cell, or "" if a slab is none of the patterns."""
    letters = [
        next((name for name, p in PATTERNS.items() if np.array_equal(p, slab)), "")
        for slab in voxels
    ]
    return "".join(letters) if all(letters) else ""


def _merge(letters: str) -> str:
    return "".join(letter for letter, _ in itertools.groupby(letters))
