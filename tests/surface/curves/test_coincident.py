"""Curves that lie on others, or pass their ends."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycube.surface.curves.features import (
    NEAR,
    SHORTEST,
    Crease,
    Features,
    covered,
    divided_at_corners,
    merged,
)


def line(start, end, ends=(0, 1)):
    points = np.linspace(start, end, 11)
    arc = np.linspace(0, np.linalg.norm(np.subtract(end, start)), 11)
    return Crease(points, arc, np.full(10, np.pi / 2), ends)


def features(*creases):
    return Features(creases, np.zeros((2, 3)), np.ones(2, bool), np.zeros((0, 2)))


@pytest.mark.parametrize("gap", [0.5, 0.99, 1.01, 3])
def test_of_two_lines_side_by_side_the_shorter_is_covered_where_they_are_near(gap):
    found = features(line((0, 0, 0), (0.2, 0, 0)), line((0, gap * NEAR, 0), (0.3, gap * NEAR, 0)))
    assert covered(found).tolist() == [gap < 1, False]


def test_a_line_is_covered_by_several_and_the_short_one_between_two_as_well():
    parts = [line((0, 0, 0), (0.3, 0, 0)), line((0.3, 0, 0), (0.55, 0, 0))]
    near = line((0.2, NEAR / 2, 0), (0.4, NEAR / 2, 0))
    between = line((0.2, 0, 0), (0.2, NEAR / 2, 0))
    across = line((0.2, 0, 0), (0.2, 0.1, 0))
    found = covered(features(between, near, *parts, across))
    assert found.tolist() == [True, True, False, False, False]


def test_a_line_that_leaves_the_other_has_a_path_of_its_own():
    found = covered(features(line((0, 0, 0), (0.5, 0, 0)), line((0, 0, 0), (0.3, 0.01, 0))))
    assert not found.any()


def test_corners_on_each_other_have_one_that_stands_for_them():
    corners = np.array([[0, 0, 0], [1, 0, 0], [NEAR / 2, 0, 0], [1, 2 * NEAR, 0], [0, NEAR / 2, 0]])
    found = merged(Features((), corners, np.ones(5, bool), np.zeros((0, 2))))
    assert found.tolist() == [0, 1, 0, 3, 0]


def passing(gap: float, turned: bool = False) -> Features:
    """A line, and one that ends at a distance from its point at 0.2."""
    ends = np.array([[0, 0, 0], [0.5, 0, 0], [0.2, gap, 0], [0.2, 0.3, 0]])
    long = line(*ends[[1, 0]], (1, 0)) if turned else line(*ends[:2], (0, 1))
    curves = (long, line(*ends[2:], (2, 3)))
    return Features(curves, ends, np.ones(4, bool), np.zeros((0, 2)), 3)


@pytest.mark.parametrize("turned", [False, True])
def test_a_line_is_divided_at_the_end_of_another_that_it_passes(turned):
    before = passing(0.9 * NEAR, turned)
    one, other, two = divided_at_corners(before).creases
    assert other is before.creases[1]
    assert [one.ends, two.ends] == ([(1, 2), (2, 0)] if turned else [(0, 2), (2, 1)])
    for part in (one, two):
        assert part.points[[0, -1]].tolist() == before.corners[list(part.ends)].tolist()
        assert part.length == pytest.approx(
            np.linalg.norm(np.diff(part.points, axis=0), axis=1).sum()
        )
        assert part.size == pytest.approx(0.5)  # of the whole curve
    assert one.length + two.length == pytest.approx(0.5, abs=1e-4)


@pytest.mark.parametrize("change", ["far", "surface", "end", "loop", "tip"])
def test_other_lines_are_not_divided(change):
    before = passing(1.1 * NEAR if change == "far" else 0.0)
    if change == "surface":
        before = replace(before, n_faces=0)
    elif change == "end":
        before.corners[2, 0] = 0.497
    elif change == "tip":
        before = replace(before, tips={2: 1})
    elif change == "loop":
        before = replace(before, creases=(line(*before.corners[:2], (-1, -1)), before.creases[1]))
    assert divided_at_corners(before).creases == before.creases


@given(st.lists(st.floats(0.02, 0.48), max_size=5), st.integers(0, 10**6))
def test_parts_lead_from_end_to_end_in_their_order(places, seed):
    rng = np.random.default_rng(seed)
    near = NEAR * rng.uniform(-0.9, 0.9, (len(places), 1)) * [[0, 0.7, 0.7]]
    at = np.column_stack([places, np.zeros((len(places), 2))]) + near
    corners = np.vstack([[[0, 0, 0], [0.5, 0, 0]], at])
    found = divided_at_corners(
        Features((line(*corners[:2]),), corners, np.ones(len(corners), bool), np.zeros((0, 2)), 3)
    )
    stops = [found.creases[0].ends[0], *(part.ends[1] for part in found.creases)]
    assert stops[0] == 0 and stops[-1] == 1 and len(set(stops)) == len(stops)
    assert (np.diff(corners[stops, 0]) > SHORTEST).all()
    assert all(part.length > SHORTEST for part in found.creases)
    assert all(a.ends[1] == b.ends[0] for a, b in pairwise(found.creases))
