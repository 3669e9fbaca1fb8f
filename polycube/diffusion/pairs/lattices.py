"""Random lattices with the shapes of machined parts: a profile, then holes, slots, bosses and ribs.

Every feature is a box in lattice indices. Along each axis it extends from end to end (all), from an
end to an inner knot (end), or between inner knots (mid), which defines the kind of feature:

    all all mid : a gap, which would divide the solid  |  all end end : step
    all mid mid : hole                                 |  all end mid : slot
    end mid mid : blind hole or pocket                 |  end end end : notch, a corner cut off

Bosses and ribs are the remaining parts of a slab at an end: boss end mid mid, rib end mid all.
Features after which the solid is not one manifold without voids are rejected.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from polycube.structure.lattice import collapse
from polycube.structure.neighbourhoods import solid_genus
from polycube.types import PerAxis, Polycube

MOST_SLABS = 6  # largest number of slabs along an axis
MOST_HANDLES = 8
SLABS = (0.03, 0.06, 0.11, 0.14, 0.2, 0.46)  # share of axes that start with 1 .. 6 slabs
MIRRORED = 0.4  # share of axes across which features are mirrored
FEATURES = 16  # largest number of tried features, in addition to the profile
LEAST_REMAINING = 0.4  # smallest share of the full boxes that remains after a feature
NARROW = 0.6  # share of intervals with a width of one slab
KINDS = {  # extent along the own axis and the two others, and share among the tried features
    "hole": (("all", "mid", "mid"), 0.42),
    "blind hole": (("end", "mid", "mid"), 0.16),
    "slot": (("all", "end", "mid"), 0.12),
    "step": (("all", "end", "end"), 0.06),
    "notch": (("end", "end", "end"), 0.06),
    "boss": (("end", "mid", "mid"), 0.1),
    "rib": (("end", "mid", "all"), 0.08),
}
STAYS = ("boss", "rib")  # the box remains, the rest of its slabs is removed
# initial profiles, in how many of the two directions they are doubled, and their share
PROFILES = {
    "block": ("", (), 0.34),
    "L": ("step", (), 0.18),
    "T": ("step", (1,), 0.12),
    "cross": ("step", (1, 2), 0.06),
    "U": ("slot", (), 0.18),
    "H": ("slot", (1,), 0.06),
    "frame": ("hole", (), 0.06),
}
SPREAD = 0.5  # standard deviation of the logarithm of the width of a slab
EXTENT = 0.4  # standard deviation of the logarithm of the length of the part along an axis
CROWDED = 0.5  # the mean length of a part of n slabs is that of n^CROWDED slabs
THIN = 0.4, 0.35  # share of axes along which parts are plates or bars, and their relative length
LEAST = 0.06  # smallest width of a slab, relative to the longest edge of the part
SHRINKS = 0.4  # smallest relative width of a slab after sections become square


class Feature(NamedTuple):
    """A box of the lattice that was removed, or that remained."""

    kind: str
    low: tuple[int, ...]  # first knot along each axis
    high: tuple[int, ...]  # last knot along each axis
    axis: int  # 0..2, the direction of the feature


class Lattice(NamedTuple):
    """Full and empty boxes, and the features of the lattice."""

    occupancy: np.ndarray  # (X, Y, Z) bool, without equal consecutive slabs and empty ends
    features: list[Feature]
    genus: int


def random_lattice(rng: np.random.Generator) -> Lattice:
    """One manifold solid without voids, with 1 to 6 slabs per axis and genus 0 to 8."""
    full = np.ones(rng.choice(MOST_SLABS, 3, p=SLABS) + 1, bool)
    mirrored = np.flatnonzero(rng.random(3) < MIRRORED)
    full, made, genus = _profile(full, rng)
    kinds, shares = list(KINDS), [share for _, share in KINDS.values()]
    for number in rng.choice(len(kinds), rng.integers(2, FEATURES + 1), p=shares):
        feature = _feature(kinds[number], full.shape, rng.permutation(3), rng)
        images = _images(feature, full.shape, mirrored) if feature else []
        after = _apply(full, images)
        remaining = np.count_nonzero(after) / np.count_nonzero(full)
        found = solid_genus(after) if LEAST_REMAINING <= remaining < 1 else None
        if found is not None and found <= MOST_HANDLES:
            full, genus, made = after, found, made + images
    return _collapsed(full, made, genus)


def _profile(full: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, list[Feature], int]:
    """The block, cut to a random profile along a random axis; the removed features; the genus."""
    names = list(PROFILES)
    kind, twofold, _ = PROFILES[rng.choice(names, p=[share for _, _, share in PROFILES.values()])]
    order = rng.permutation(3)
    feature = _feature(kind, full.shape, order, rng) if kind else None
    cut = _images(feature, full.shape, order[list(twofold)]) if feature else []
    after = _apply(full, cut)
    genus = solid_genus(after)
    return (full, [], 0) if genus is None else (after, cut, genus)


def _feature(
    kind: str, shape: tuple[int, ...], order: np.ndarray, rng: np.random.Generator
) -> Feature | None:
    """A feature at a random place, its own axis first in `order`; None if there is no room."""
    low, high = [0, 0, 0], [0, 0, 0]
    for axis, extent in zip(order, KINDS[kind][0], strict=True):
        n = shape[axis]
        if n < {"all": 1, "end": 2, "mid": 3}[extent]:
            return None
        low[axis], high[axis] = _interval(extent, n, rng)
    return Feature(kind, tuple(low), tuple(high), int(order[0]))


def _interval(extent: str, n: int, rng: np.random.Generator) -> tuple[int, int]:
    """Knots of n slabs between which a feature lies."""
    if extent == "all":
        return 0, n
    low = 0 if extent == "end" else int(rng.integers(1, n - 1))
    high = low + 1 if rng.random() < NARROW else int(rng.integers(low + 1, n))
    return (n - high, n - low) if rng.random() < 0.5 else (low, high)


def _images(feature: Feature, shape: tuple[int, ...], mirrored: np.ndarray) -> list[Feature]:
    """The feature and its mirror images with respect to the centre of the lattice."""
    images = [feature]
    for axis in mirrored:
        for each in list(images):
            low, high = list(each.low), list(each.high)
            low[axis], high[axis] = shape[axis] - high[axis], shape[axis] - low[axis]
            image = each._replace(low=tuple(low), high=tuple(high))
            images += [image] if image not in images else []
    return images


def _apply(full: np.ndarray, features: list[Feature]) -> np.ndarray:
    """The boxes after removing some features, all of one kind."""
    after = full.copy()
    stays = bool(features) and features[0].kind in STAYS
    for feature in features:
        box = _box(feature)
        if stays:  # all boxes of its slabs
            np.moveaxis(after, feature.axis, 0)[box[feature.axis]] = False
        after[box] = False
    for feature in features if stays else []:
        after[_box(feature)] = full[_box(feature)]
    return after


def _box(feature: Feature) -> tuple[slice, ...]:
    return tuple(slice(a, b) for a, b in zip(feature.low, feature.high, strict=True))


def _collapsed(full: np.ndarray, made: list[Feature], genus: int) -> Lattice:
    """The lattice without superfluous knots and without features removed by later ones."""
    x, y, z = (np.arange(n + 1.0) for n in full.shape)
    solid = collapse(Polycube(full, x, y, z, (1, 1, 1), ("lattice",)))
    number = [  # of each knot, or of the next one that remains
        np.searchsorted(knots[:-1], np.arange(n + 1)).tolist()
        for knots, n in zip(solid.knots, full.shape, strict=True)
    ]
    found = {}
    for feature in made:
        low = tuple(own[i] for own, i in zip(number, feature.low, strict=True))
        high = tuple(own[i] for own, i in zip(number, feature.high, strict=True))
        moved = feature._replace(low=low, high=high)
        inside = solid.occupancy[_box(moved)]
        if 0 < inside.size < solid.occupancy.size and (inside == (feature.kind in STAYS)).all():
            found[low, high, feature.axis] = moved
    return Lattice(solid.occupancy, list(found.values()), genus)


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
    slabs = [2 / longest * each for each in slabs]
    x, y, z = (np.append(0, np.cumsum(each)) - each.sum() / 2 for each in slabs)
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
