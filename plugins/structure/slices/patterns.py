"""Contexts of a row of cells as patterns of slabs.

Along the row, a polycube is a sequence of slabs: F full, R a ring (the centre removed), Y and Z two
bars (the central z column removed, a hole along y; the central y row removed, a hole along z).
Repeated slabs are redundant: cube + hole_y = FFF FYF = FYF. A few patterns thus represent all
contexts, and the structure of a part is found by aligning its slices with each pattern.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from polycube.structure.lattice import collapse, is_manifold, lattice
from polycube.types import Polycube

FULL = np.ones((3, 3), bool)
SECTIONS = {name: FULL.copy() for name in "FRYZ"}  # (y, z)
SECTIONS["R"][1, 1] = False
SECTIONS["Y"][:, 1] = False
SECTIONS["Z"][1, :] = False


@dataclass(frozen=True, eq=False)
class SlabPattern:
    """A pattern and the (collapsed) polycubes of all its contexts."""

    slabs: str  # such as RFYF
    polycubes: tuple[Polycube, ...]

    def without_ring(self) -> set[str]:
        """The patterns with one R removed."""
        return {
            _merge(self.slabs[:i] + self.slabs[i + 1 :])
            for i, slab in enumerate(self.slabs)
            if slab == "R" and len(self.slabs) > 1
        }


def slab_patterns(
    grid: tuple[int, int, int], primitives: Mapping[str, np.ndarray]
) -> list[SlabPattern]:
    """Patterns of the contexts of an n x 1 x 1 grid, short ones first; the last cells may be empty.

    Primitives with a slab other than F, R, Y, Z have no pattern.
    """
    slabs_of = {name: s for name, voxels in primitives.items() if (s := _slabs_of_cell(voxels))}
    polycubes: dict[str, list[Polycube]] = {}
    for n_cells in range(1, grid[0] + 1):
        for cells in itertools.product(slabs_of, repeat=n_cells):
            slabs = _merge("".join(slabs_of[name] for name in cells))
            context = cells + (None,) * (grid[0] - n_cells)
            polycube = collapse(lattice(grid, context, primitives))
            if is_manifold(polycube):
                polycubes.setdefault(slabs, []).append(polycube)
    ordered = sorted(polycubes, key=lambda slabs: (len(slabs), slabs))
    return [SlabPattern(slabs, tuple(polycubes[slabs])) for slabs in ordered]


def slabs_of_context(context: Sequence[str | None], primitives: Mapping[str, np.ndarray]) -> str:
    """Slabs of a context of a row of cells; "" if a slab is not F, R, Y or Z."""
    cells = [_slabs_of_cell(primitives[name]) for name in context if name is not None]
    return _merge("".join(cells)) if all(cells) else ""


def _slabs_of_cell(voxels: np.ndarray) -> str:
    """Three slabs of a cell; "" if a slab is not F, R, Y or Z."""
    slabs = [
        next((name for name, p in SECTIONS.items() if np.array_equal(p, section)), "")
        for section in voxels
    ]
    return "".join(slabs) if all(slabs) else ""


def _merge(slabs: str) -> str:
    return "".join(slab for slab, _ in itertools.groupby(slabs))
