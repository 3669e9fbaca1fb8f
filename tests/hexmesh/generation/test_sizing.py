"""Lengths, boxes and graded lines, exact on straight lattices."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.hexmesh.generation import sizing
from polycube.hexmesh.generation.template import counts, grid_lines
from polycube.structure.rough_map import affine_map, identity_map
from tests.fixtures.polycubes import bar, ring


def test_a_length_is_a_number_or_a_share():
    assert sizing.length(3, 20.0) == 3
    assert sizing.length("5%", 20.0) == sizing.length(" 5 %", 20.0) == 1
    assert sizing.length("5", 20.0) == -1


def test_number_of_hexes_is_that_of_the_occupied_boxes():
    three = (np.array([2, 3, 4]), np.array([1, 1, 1]), np.array([5]))
    assert sizing.number_of_hexes(ring(), three) == (9 + 9 + 9 - 3) * 5


def test_without_a_box_intervals_have_equal_parts():
    parts = counts(ring(), identity_map(ring()), 0.1)
    plain = grid_lines(ring(), parts)
    for found, wanted in zip(
        sizing.graded(ring(), identity_map(ring()), parts, []), plain, strict=True
    ):
        assert found == pytest.approx(wanted)
    assert [n.tolist() for n in sizing.counts_of(ring(), plain)] == [n.tolist() for n in parts]


def test_slabs_of_a_box_have_the_requested_size():
    """A bar with parts of 0.25, and 0.05 in its last quarter, in a map ten times as large."""
    large = affine_map(bar(), 10 * np.eye(3), np.zeros(3))
    box = sizing.Box(np.array([15.0, -1, -1]), np.array([20.0, 11, 11]), 0.5)
    lines = sizing.graded(bar(), large, counts(bar(), large, 2.5), [box])
    x = lines[0]
    steps = np.diff(x)
    assert steps[x[:-1] > 1.55].max() <= 0.05 * 1.05
    assert steps[x[1:] < 0.5].min() > 0.15
    assert (np.diff(lines[1])[1:-1] < 0.06).all()  # the box is as wide as the bar


def test_a_box_along_one_axis_does_not_affect_the_others():
    where = identity_map(bar())
    parts = counts(bar(), where, 0.25)
    box = sizing.box_of({"box": [1.5, 0, 0, 2, 1, 1], "size": 0.05, "along": "x"}, 1.0)
    x, y, z = sizing.graded(bar(), where, parts, [box])
    assert len(x) > 2 * len(grid_lines(bar(), parts)[0])
    assert (len(y), len(z)) == (5, 5)


@pytest.mark.slow
@settings(max_examples=12, deadline=None)
@given(st.floats(0.1, 0.9), st.floats(0.02, 0.3), st.floats(0.005, 0.2), st.integers(0, 2))
def test_neighbouring_parts_have_similar_lengths_and_knots_are_lines(middle, half, size, axis):
    low, high = np.full(3, -1.0), np.full(3, 2.0)
    low[axis], high[axis] = middle - half, middle + half
    where = identity_map(ring())
    parts = counts(ring(), where, 0.12)
    for a, line in enumerate(sizing.graded(ring(), where, parts, [sizing.Box(low, high, size)])):
        knots = ring().knots[a]
        assert np.abs(line - knots[:, None]).min(axis=1) == pytest.approx(0, abs=1e-9)
        steps = np.diff(line)
        assert (steps > 0).all()
        ratio = steps[1:] / steps[:-1]
        assert np.maximum(ratio, 1 / ratio).max() < 2.0
        assert (sizing.counts_of(ring(), [line] * 3)[a] >= parts[a]).all()
