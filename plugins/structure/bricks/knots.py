"""Knots of the slabs of a voxel solid: where its slices change, and at its holes.

For each axis, the stack of slices is divided into k segments with the smallest difference from
their majority slice. Small holes change few pixels and would get no knots, so the sides and ends of
enclosed holes are fixed, and the other knots are chosen in addition.
"""

from collections.abc import Iterable, Iterator

import numpy as np
from numba import njit
from scipy import ndimage

from polycube.surface.measures import connected

from ..slices.sections import PLANE

AREA_RATIO = 2.0  # largest ratio of the areas of one hole in two neighbouring slices


def segmentations(
    costs: np.ndarray, most: int, shortest: int, wanted: Iterable[int] = ()
) -> list[np.ndarray]:
    """Best divisions into 1, 2 ... `most` segments, and one more for each wanted knot.

    costs : (X, X + 1) see `segment_costs`
    shortest : smallest number of slices of a segment
    wanted : knots of every division, except those too close to an end or to an earlier one

    The other knots are chosen after these, because the sides of a hole need no other knot at its
    ends.
    """
    n = len(costs)
    fixed: list[int] = []
    for at in wanted:
        if all(abs(at - k) >= shortest for k in [0, *fixed, n]):
            fixed.append(at)
    costs = costs.copy()
    for at in fixed:
        costs[:at, at + 1 :] = np.inf
    best = np.where(np.arange(n + 1) == 0, 0.0, np.inf)
    origins, cuts = [], []
    for k in range(1, min(most + len(fixed), n // shortest) + 1):
        begin = np.zeros(n + 1, int)
        new = np.full(n + 1, np.inf)
        for end in range(k * shortest, n + 1):
            total = best[: end - shortest + 1] + costs[: end - shortest + 1, end]
            begin[end] = total.argmin()
            new[end] = total[begin[end]]
        best = new
        origins.append(begin)
        if np.isfinite(best[n]):
            knots = [n]
            for origin in reversed(origins):
                knots.append(int(origin[knots[-1]]))
            cuts.append(np.array(knots[::-1]))
    return cuts


def segment_costs(solid: np.ndarray) -> np.ndarray:
    """(X, X + 1) voxels of slices i to j - 1 that differ from the majority of their line."""
    return _segment_costs(np.ascontiguousarray(solid.reshape(len(solid), -1).astype(np.uint8)))


@njit(cache=True)
def _segment_costs(slices: np.ndarray) -> np.ndarray:
    """The costs of (X, N) slices."""
    n, area = slices.shape
    costs = np.zeros((n, n + 1))
    for i in range(n):
        full = np.zeros(area, np.int64)
        for j in range(i, n):
            length, cost = j - i + 1, 0
            for p in range(area):
                full[p] += slices[j, p]
                cost += min(full[p], length - full[p])
            costs[i, j + 1] = cost
    return costs


def hole_knots(solid: np.ndarray, least: int) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """For each axis the sides of the holes enclosed by slices, and their ends, in voxels.

    Enclosed background in consecutive slices is one hole while its area changes little; it needs at
    least `least` slices.
    """
    sides: list[list[float]] = [[], [], []]
    ends: list[list[float]] = [[], [], []]
    padded = np.pad(solid, 1)
    for along in range(3):
        across = [axis for axis in range(3) if axis != along]
        for first, last, middle, width in _holes(np.moveaxis(padded, along, 0)):
            if last - first < least:
                continue
            ends[along] += [first - 1, last - 1]
            for axis, at, size in zip(across, middle, width, strict=True):
                sides[axis] += [at - size / 2 - 1, at + size / 2 - 1]

    def knots(found: list[list[float]]) -> list[np.ndarray]:
        pairs = zip(found, solid.shape, strict=True)
        return [np.unique(np.clip(np.round(values), 0, n).astype(int)) for values, n in pairs]

    return knots(sides), knots(ends)


def _holes(solid: np.ndarray) -> Iterator[tuple[int, int, np.ndarray, np.ndarray]]:
    """First slice, slice after the last, centre (2,) and sides (2,) of the holes along axis 0.

    The sides are those of a rectangle with the area and proportions of the hole.
    """
    background = ndimage.label(~solid, PLANE)[0]
    regions = np.where(solid | (background == background[:, :1, :1]), 0, background)
    _, regions = np.unique(regions, return_inverse=True)
    regions = regions.reshape(solid.shape)
    number = regions.max() + 1
    area = np.bincount(regions.ravel(), minlength=number)
    both = np.stack([regions[:-1], regions[1:]], axis=-1)[(regions[:-1] > 0) & (regions[1:] > 0)]
    before, after = np.unique(both, axis=0).T if len(both) else np.zeros((2, 0), int)
    is_similar = np.maximum(area[before], area[after]) < AREA_RATIO * np.minimum(
        area[before], area[after]
    )
    hole = connected(before[is_similar], after[is_similar], number)
    boxes = ndimage.find_objects(regions)
    for members in (np.flatnonzero(hole == h) for h in np.unique(hole[1:])):
        spans = np.array([[(s.start, s.stop) for s in boxes[m - 1]] for m in members])  # (M, 3, 2)
        sides = np.median(spans[:, 1:, 1] - spans[:, 1:, 0], axis=0)
        fill = np.sqrt(np.median(area[members]) / sides.prod())
        middle = np.median(spans[:, 1:].mean(axis=2), axis=0)
        yield spans[:, 0, 0].min(), spans[:, 0, 1].max(), middle, sides * min(1.0, fill)
