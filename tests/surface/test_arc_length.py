"""The compiled paths against the same in numpy."""

import numpy as np
import pytest

from polycube.surface import arc_length as sliding
from polycube.surface.curves.features import Crease
from tests.fixtures.surfaces import circle


def zigzag() -> Crease:
    points = np.array([[0, 0, 0], [1, 0, 0.2], [1.2, 1, 0], [0.1, 1.1, 0], [0, 0.3, 0.1]])
    arc = np.append(0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    return Crease(points, arc, np.full(4, np.pi / 2), (0, 1))


def slow_nearest(crease, points, expected):
    """All segments at once; see `sliding.nearest`."""
    start, step, length = crease.points[:-1], np.diff(crease.points, axis=0), np.diff(crease.arc)
    along = np.einsum("nsd,sd->ns", points[:, None] - start, step) / length**2
    along = np.clip(along, 0, 1)
    square = ((points[:, None] - start - along[:, :, None] * step) ** 2).sum(axis=2)
    off = crease.arc[:-1] + along * length - expected[:, None]
    if crease.is_loop:
        off -= crease.length * np.round(off / crease.length)
    row, best = np.arange(len(points)), (square + (0.2 * off) ** 2).argmin(axis=1)
    beyond = np.abs(off - off[row, best][:, None]) > 3 * np.sqrt(square[row, best])[:, None]
    best = np.where(beyond, np.inf, square).argmin(axis=1)
    return expected + off[row, best], square[row, best]


def slow_spread(crease, x):
    """In order by the mean of the running maximum and minimum; see `sliding.spread`."""
    closed = np.concatenate([x, x[:1]]) if crease.is_loop else x
    length = np.append(0, np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1)))
    start = crease.nearest(x[:1])[0][0] if crease.is_loop else 0.0
    arc, _ = slow_nearest(crease, x, (start + length / length[-1] * crease.length)[: len(x)])
    apart = 0.2 * crease.length / (len(closed) - 1) * np.arange(len(x))
    slack = arc - apart
    slack = (np.maximum.accumulate(slack) + np.minimum.accumulate(slack[::-1])[::-1]) / 2
    low = slack[0] if crease.is_loop else 0.0
    return np.clip(slack, low, low + 0.8 * crease.length) + apart


@pytest.mark.parametrize("crease", [circle(20), zigzag()])
def test_nearest_and_spread_equal_the_slow_versions(crease):
    rng = np.random.default_rng(0)
    for _ in range(20):
        x, expected = rng.normal(size=(9, 3)), rng.uniform(-1, 9, 9)
        found = sliding.nearest(crease.points, crease.arc, crease.is_loop, x, expected)
        assert np.array(found) == pytest.approx(np.array(slow_nearest(crease, x, expected)))
        arc = sliding.spread(crease.points, crease.arc, crease.is_loop, x)
        assert arc == pytest.approx(slow_spread(crease, x))


def test_all_paths_slide_at_once():
    creases, rng = [circle(20), zigzag(), circle(7)], np.random.default_rng(1)
    paths = [rng.normal(size=(n, 3)) for n in (5, 2, 8)]
    feet, way = sliding.slide(
        *(np.concatenate([getattr(c, name) for c in creases]) for name in ("points", "arc")),
        np.cumsum([0, *(len(c.arc) for c in creases)]),
        np.array([c.is_loop for c in creases]),
        np.concatenate(paths),
        np.cumsum([0, *map(len, paths)]),
    )
    each = [c.at(slow_spread(c, x)) for c, x in zip(creases, paths, strict=True)]
    assert feet == pytest.approx(np.concatenate([foot for foot, _, _ in each]))
    assert way == pytest.approx(np.concatenate([direction for _, direction, _ in each]))
