"""Random widths for the slabs of a lattice: the proportions of a part."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from polycube.diffusion.pairs.lattices import Feature, Lattice
from polycube.types import PerAxis

SPREAD = 0.5  # standard deviation of the logarithm of the width of a slab
EXTENT = 0.4  # of the logarithm of the length of the part along an axis
CROWDED = 0.5  # a part of n slabs is as long as n^CROWDED slabs, before it is made random
THIN = 0.4, 0.35  # share of axes' parts that are plates or bars, and how much shorter they are
LEAST = 0.06  # width of a slab, of the longest edge of the part
SHRINKS = 0.4  # what must be left of a slab's width where sections become square


def random_knots(lattice: Lattice, square: Sequence[Feature], rng: np.random.Generator) -> PerAxis:
    """Knots of the slabs, centred, the longest edge 2: as in the learning frame.

    A part that is its own mirror image remains so.  The features in `square` get square sections
    across their axes, one after the other, where no slab becomes too narrow by it.
    """
    lengths = np.exp(rng.normal(0, EXTENT, 3))
    if rng.random() < THIN[0]:
        lengths[rng.choice(3, rng.integers(1, 3), replace=False)] *= THIN[1]
    shape = lattice.occupancy.shape
    slabs = [_widths(lattice.occupancy, axis, rng) * lengths[axis] for axis in range(3)]
    longest = max(each.sum() for each in slabs)
    widths = np.maximum(np.concatenate(slabs), LEAST * longest)
    widths = _with_squares(widths, [_difference(each, shape) for each in square])
    slabs = np.split(widths, np.cumsum(shape)[:2])
    longest = max(each.sum() for each in slabs)
    x, y, z = (_knots(2 / longest * each) for each in slabs)
    return x, y, z


def _widths(occupancy: np.ndarray, axis: int, rng: np.random.Generator) -> np.ndarray:
    """(n,) widths of the slabs across an axis, together n^CROWDED."""
    n = occupancy.shape[axis]
    widths = np.exp(rng.normal(0, SPREAD, n))
    if np.array_equal(occupancy, np.flip(occupancy, axis)):
        widths = (widths + widths[::-1]) / 2
    return widths * n**CROWDED / widths.sum()


def _difference(feature: Feature, shape: tuple[int, ...]) -> np.ndarray:
    """Weights of all widths, which add up to the one side of a section less the other."""
    rows = [np.zeros(n) for n in shape]
    for axis, sign in (((feature.axis + 1) % 3, 1), ((feature.axis + 2) % 3, -1)):
        rows[axis][feature.low[axis] : feature.high[axis]] = sign
    return np.concatenate(rows)


def _with_squares(widths: np.ndarray, rows: Sequence[np.ndarray]) -> np.ndarray:
    """Nearest widths, relative to what they were, of which the rows add up to nothing."""
    kept: list[np.ndarray] = []
    found = widths
    for row in rows:
        scaled = np.array([*kept, row * widths])
        factor = 1 - np.linalg.lstsq(scaled, scaled.sum(axis=1), rcond=1e-9)[0]
        if factor.min() >= SHRINKS:
            kept, found = list(scaled), widths * factor
    return found


def _knots(widths: np.ndarray) -> np.ndarray:
    return np.append(0, np.cumsum(widths)) - widths.sum() / 2
