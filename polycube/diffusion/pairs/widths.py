"""Random widths for the slabs of a lattice: the proportions of a part."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from polycube.diffusion.pairs.lattices import Feature, Lattice
from polycube.types import PerAxis

SPREAD = 0.45  # standard deviation of the logarithm of the width of a slab
EXTENT = 0.35  # of the logarithm of the length of the part along an axis
CROWDED = 0.5  # a part of n slabs is as long as n^CROWDED slabs, before it is made random
LEAST = 0.06  # width of a slab, of the longest edge of the part


def random_knots(lattice: Lattice, square: Sequence[Feature], rng: np.random.Generator) -> PerAxis:
    """Knots of the slabs, centred, the longest edge 2: as in the learning frame.

    A part that is its own mirror image remains so.  The features in `square` get square sections
    across their axes, as far as one does not contradict the other.
    """
    widths = [_widths(lattice.occupancy, axis, rng) for axis in range(3)]
    for feature in square:
        u, v = (slice(feature.low[a], feature.high[a]) for a in _across(feature.axis))
        wide, narrow = (widths[a] for a in _across(feature.axis))
        narrow[v] *= wide[u].sum() / narrow[v].sum()
    longest = max(each.sum() for each in widths)
    widths = [np.maximum(each, LEAST * longest) for each in widths]
    longest = max(each.sum() for each in widths)
    x, y, z = (_knots(2 / longest * each) for each in widths)
    return x, y, z


def _widths(occupancy: np.ndarray, axis: int, rng: np.random.Generator) -> np.ndarray:
    n = occupancy.shape[axis]
    widths = np.exp(rng.normal(0, SPREAD, n))
    if np.array_equal(occupancy, np.flip(occupancy, axis)):
        widths = (widths + widths[::-1]) / 2
    return widths * n**CROWDED / widths.sum() * np.exp(rng.normal(0, EXTENT))


def _knots(widths: np.ndarray) -> np.ndarray:
    return np.append(0, np.cumsum(widths)) - widths.sum() / 2


def _across(axis: int) -> tuple[int, int]:
    return (axis + 1) % 3, (axis + 2) % 3
