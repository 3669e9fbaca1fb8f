"""Align the slices of a part with a pattern: the cheapest division into its slabs.

The cost of a slice as part of a slab is the area that would have to be added or removed, plus
penalties for features that are missing or different; dynamic programming finds the best monotone
division for every pattern.
"""

from __future__ import annotations

import itertools
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from polycube.structure.lattice import collapse, is_manifold, lattice
from polycube.surface.voxels import Voxels
from polycube.types import Polycube

from .options import Costs
from .sections import Slices, measure

Slab = TypeVar("Slab", bound=Hashable)
FULL = np.ones((3, 3), bool)
SECTIONS = {name: FULL.copy() for name in "FRYZ"}  # (y, z)
SECTIONS["R"][1, 1] = False
SECTIONS["Y"][:, 1] = False
SECTIONS["Z"][1, :] = False


@dataclass(frozen=True, eq=False)
class View:
    """A part in a frame after one of the rotations of the cube."""

    frame: np.ndarray  # (3, 3) rotation from model coordinates to the frame
    turn: np.ndarray  # (3, 3) rotation from the frame to the view
    voxels: Voxels  # in the axes of the view

    def turned(self, turn: np.ndarray) -> View:
        """The view after another rotation."""
        return View(self.frame, turn @ self.turn, self.voxels.turned(turn))

    def to_model(self, points: np.ndarray) -> np.ndarray:
        """(..., 3) positions in voxels of the view, in model coordinates."""
        return (points * self.voxels.size + self.voxels.origin) @ (self.turn @ self.frame)


@dataclass(frozen=True, eq=False)
class Alignment:
    """An alignment with a pattern along the first axis of a view."""

    pattern: SlabPattern
    cost: float
    bounds: np.ndarray  # (slabs + 1,) slice at which each slab begins, and the end
    slices: Slices
    view: View


def align(view: View, patterns: Sequence[SlabPattern], costs: Costs) -> list[Alignment]:
    """All possible alignments along the first axis; empty without solid voxels."""
    slices = measure(view.voxels.solid)
    used = np.flatnonzero(slices.area)
    if len(used) == 0:
        return []
    low, high = used[0], used[-1] + 1
    emission = {name: e[low:high] for name, e in emissions(slices, costs).items()}
    total = slices.area.sum()
    cost_of, cuts = {}, {}
    for pattern in patterns:
        cost_of[pattern.slabs], cuts[pattern.slabs] = cut(pattern.slabs, emission, costs.shortest)
    alignments = []
    for pattern in patterns:
        cost = cost_of[pattern.slabs]
        simpler = min((cost_of.get(s, np.inf) for s in pattern.without_ring()), default=np.inf)
        pays = not np.isfinite(simpler) or simpler - cost >= costs.blind * costs.letter * total
        if np.isfinite(cost) and pays:
            n_holes = sum(slab in "YZ" for slab in pattern.slabs)
            extra = costs.letter * (len(pattern.slabs) - 1 - 2 * n_holes)
            bounds = cuts[pattern.slabs] + low
            alignments.append(Alignment(pattern, cost / total + extra, bounds, slices, view))
    return alignments


def emissions(slices: Slices, costs: Costs) -> dict[str, np.ndarray]:
    """(X,) cost in voxels of each slice as part of each slab; 0 for a slice without solid."""
    area, holes = slices.area, slices.hole_total
    first, second = slices.piece_area.T
    hole = slices.hole_area
    rest = area - first
    hidden = costs.concave * np.maximum(0, slices.between[:, 2] - holes)
    missing = costs.missing * (area + holes)
    box = slices.piece_box
    boxes = (box[..., 1] - box[..., 0]) * (box[..., 3] - box[..., 2])  # areas
    ragged = costs.ragged * np.maximum(0, boxes[:, 0] - first - hole)
    one = rest + holes + hidden  # as for one full piece
    no_ring = rest + area * np.where(second > 0, 0.3, 0.5) + hidden / 2
    ring = rest + holes - hole + hidden + np.maximum(0, missing - hole) + ragged
    found = {"F": one + ragged, "R": np.where(hole > 0, ring, no_ring)}
    blunt = 0.5 * area + 0.5 * holes + hidden
    bars = rest - second + holes + np.maximum(0, missing - second)
    bars = bars + costs.ragged * (boxes.sum(axis=1) - first - second)
    low, high = box[..., ::2], box[..., 1::2]  # (X, 2 boxes, y z)
    apart = low.max(axis=1) >= high.min(axis=1)  # whether the pieces are separated in y, z
    offset = ((low + high)[:, 0] - (low + high)[:, 1]) ** 2
    askew = offset[:, ::-1] / (offset.sum(axis=1, keepdims=True) + 1e-9)  # across y, z
    for slab, gap in (("Y", 1), ("Z", 0)):  # the bars of Y are separated in z
        cost = np.minimum(one - slices.gain[:, gap] + missing / 2, blunt)
        extra = np.where(apart[:, gap], 0, costs.overlap) + costs.direction * askew[:, gap]
        inside = np.maximum(0, slices.between[:, 1 - gap] - holes) * apart[:, gap]
        two = bars + costs.concave * inside + area * extra
        found[slab] = np.where(second > 0, np.minimum(cost, two), cost)
    return {name: np.where(area > 0, cost, 0) for name, cost in found.items()}


def cut(
    slabs: Sequence[Slab], emission: Mapping[Slab, np.ndarray], shortest: int
) -> tuple[float, np.ndarray]:
    """Smallest cost of dividing X slices into the slabs in order, and the start of each one.

    A full slab at an end may be a single slice; the cost is infinite if there are too few slices.
    """
    n = len(emission[slabs[0]])
    best, origin = np.where(np.arange(n + 1) == 0, 0.0, np.inf), []
    for index, slab in enumerate(slabs):
        is_cap = slab == "F" and index in (0, len(slabs) - 1) and len(slabs) > 1
        wide = 1 if is_cap else shortest
        total = np.append(0, np.cumsum(emission[slab]))
        start = best - total  # cost of starting the slab at each slice
        least = np.minimum.accumulate(start)
        new = np.append(True, least[1:] < least[:-1])
        begin = np.maximum.accumulate(np.where(new, np.arange(n + 1), 0))
        best = np.full(n + 1, np.inf)
        best[wide:] = least[: n + 1 - wide] + total[wide:]
        origin.append(np.append(np.zeros(wide, int), begin)[: n + 1])
    bounds = [n]
    for begin in reversed(origin):
        bounds.append(int(begin[bounds[-1]]))
    return float(best[n]), np.array(bounds[::-1])


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
            polycube = collapse(lattice(grid, cells + (None,) * (grid[0] - n_cells), primitives))
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
    known = SECTIONS.items()
    slabs = [next((name for name, p in known if np.array_equal(p, each)), "") for each in voxels]
    return "".join(slabs) if all(slabs) else ""


def _merge(slabs: str) -> str:
    return "".join(slab for slab, _ in itertools.groupby(slabs))
