"""Random widths of the slabs of a lattice: the proportions of a part."""

from collections.abc import Sequence

import numpy as np

from polycube.diffusion.pairs.lattices import Feature, Lattice
from polycube.types import PerAxis

SPREAD = 0.5  # standard deviation of the logarithm of the width of a slab
EXTENT = 0.4  # standard deviation of the logarithm of the length of the part along an axis
CROWDED = 0.5  # the mean length of a part of n slabs is that of n^CROWDED slabs
THIN = 0.4, 0.35  # share of axes along which parts are plates or bars, and their relative length
LEAST = 0.06  # smallest width of a slab, relative to the longest edge of the part
SHRINKS = 0.4  # smallest relative width of a slab after sections become square


def random_knots(lattice: Lattice, square: Sequence[Feature], rng: np.random.Generator) -> PerAxis:
    """Knots of the slabs, centred, the longest edge 2: as in the learning frame.

    A symmetric part stays symmetric. The features in `square` get square sections across their
    axes, in sequence, unless a slab becomes too narrow.
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
    """(n,) widths of the slabs across an axis, with the sum n^CROWDED."""
    n = occupancy.shape[axis]
    widths = np.exp(rng.normal(0, SPREAD, n))
    if np.array_equal(occupancy, np.flip(occupancy, axis)):
        widths = (widths + widths[::-1]) / 2
    return widths * n**CROWDED / widths.sum()


def _difference(feature: Feature, shape: tuple[int, ...]) -> np.ndarray:
    """Weights of all widths whose sum is the difference of the two sides of a section."""
    rows = [np.zeros(n) for n in shape]
    for axis, sign in (((feature.axis + 1) % 3, 1), ((feature.axis + 2) % 3, -1)):
        rows[axis][feature.low[axis] : feature.high[axis]] = sign
    return np.concatenate(rows)


def _with_squares(widths: np.ndarray, rows: Sequence[np.ndarray]) -> np.ndarray:
    """Closest widths, relative to the given ones, for which the products with the rows are zero."""
    squared: list[np.ndarray] = []
    found = widths
    for row in rows:
        scaled = np.array([*squared, row * widths])
        factor = 1 - np.linalg.lstsq(scaled, scaled.sum(axis=1), rcond=1e-9)[0]
        if factor.min() >= SHRINKS:
            squared, found = list(scaled), widths * factor
    return found


def _knots(widths: np.ndarray) -> np.ndarray:
    return np.append(0, np.cumsum(widths)) - widths.sum() / 2
