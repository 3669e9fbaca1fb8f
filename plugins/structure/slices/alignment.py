"""Align the slices of a part with a pattern: the cheapest division into its letters.

The cost of a slice with a letter is the area that would have to be added or removed, plus penalties
for features that are missing or different; dynamic programming finds the best monotone division for
every pattern.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from polycube.surface.voxels import Voxels

from .options import Costs
from .patterns import Word
from .sections import Slices, measure

Letter = TypeVar("Letter", bound=Hashable)


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
class Reading:
    """An alignment with a pattern along the first axis of a view."""

    word: Word
    cost: float
    bounds: np.ndarray  # (letters + 1,) slice at which each letter begins, and the end
    slices: Slices
    view: View


def read(view: View, words: Sequence[Word], costs: Costs) -> list[Reading]:
    """All possible alignments along the first axis; empty without solid voxels."""
    slices = measure(view.voxels.solid)
    used = np.flatnonzero(slices.area)
    if len(used) == 0:
        return []
    low, high = used[0], used[-1] + 1
    emission = {name: e[low:high] for name, e in emissions(slices, costs).items()}
    total = slices.area.sum()
    misread, cuts = {}, {}
    for word in words:
        misread[word.letters], cuts[word.letters] = cut(word.letters, emission, costs.shortest)
    readings = []
    for word in words:
        raw = misread[word.letters]
        plain = min((misread.get(w, np.inf) for w in word.without_ring()), default=np.inf)
        pays = not np.isfinite(plain) or plain - raw >= costs.blind * costs.letter * total
        if np.isfinite(raw) and pays:
            n_holes = sum(letter in "YZ" for letter in word.letters)
            extra = costs.letter * (len(word.letters) - 1 - 2 * n_holes)
            bounds = cuts[word.letters] + low
            readings.append(Reading(word, raw / total + extra, bounds, slices, view))
    return readings


def emissions(slices: Slices, costs: Costs) -> dict[str, np.ndarray]:
    """(X,) cost in voxels of each slice with each letter; 0 for a slice without solid."""
    area, holes = slices.area, slices.hole_total
    first, second = slices.piece_area.T
    hole = slices.hole_area
    rest = area - first
    hidden = costs.concave * np.maximum(0, slices.between[:, 2] - holes)
    missing = costs.missing * (area + holes)
    boxes = _box_area(slices.piece_box)
    ragged = costs.ragged * np.maximum(0, boxes[:, 0] - first - hole)
    one = rest + holes + hidden  # as for one full piece
    no_ring = rest + area * np.where(second > 0, 0.3, 0.5) + hidden / 2
    ring = rest + holes - hole + hidden + np.maximum(0, missing - hole) + ragged
    letters = {"F": one + ragged, "R": np.where(hole > 0, ring, no_ring)}
    blunt = 0.5 * area + 0.5 * holes + hidden
    bars = rest - second + holes + np.maximum(0, missing - second)
    bars = bars + costs.ragged * (boxes.sum(axis=1) - first - second)
    apart, askew = _arrangement(slices.piece_box)
    for letter, gap in (("Y", 1), ("Z", 0)):  # the bars of Y are separated in z
        cost = np.minimum(one - slices.gain[:, gap] + missing / 2, blunt)
        extra = np.where(apart[:, gap], 0, costs.overlap) + costs.direction * askew[:, gap]
        inside = np.maximum(0, slices.between[:, 1 - gap] - holes) * apart[:, gap]
        two = bars + costs.concave * inside + area * extra
        letters[letter] = np.where(second > 0, np.minimum(cost, two), cost)
    return {name: np.where(area > 0, cost, 0) for name, cost in letters.items()}


def _box_area(boxes: np.ndarray) -> np.ndarray:
    """(...,) areas of boxes (..., 4)."""
    return (boxes[..., 1] - boxes[..., 0]) * (boxes[..., 3] - boxes[..., 2])


def _arrangement(boxes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whether two boxes (X, 2, 4) are separated in y, z; relative offset across y, z; (X, 2)."""
    low, high = boxes[..., ::2], boxes[..., 1::2]  # (X, 2 boxes, y z)
    apart = low.max(axis=1) >= high.min(axis=1)
    offset = ((low + high)[:, 0] - (low + high)[:, 1]) ** 2
    return apart, offset[:, ::-1] / (offset.sum(axis=1, keepdims=True) + 1e-9)


def cut(
    letters: Sequence[Letter], emission: Mapping[Letter, np.ndarray], shortest: int
) -> tuple[float, np.ndarray]:
    """Smallest cost of dividing X slices into the letters in order, and the start of each one.

    A full letter at an end may be a single slice; the cost is infinite if there are too few slices.
    """
    n = len(emission[letters[0]])
    best, origin = np.where(np.arange(n + 1) == 0, 0.0, np.inf), []
    for index, letter in enumerate(letters):
        is_cap = letter == "F" and index in (0, len(letters) - 1) and len(letters) > 1
        wide = 1 if is_cap else shortest
        total = np.append(0, np.cumsum(emission[letter]))
        start = best - total  # cost of starting the letter at each slice
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
