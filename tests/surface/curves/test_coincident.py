"""Curves that lie on others."""

import numpy as np
import pytest

from polycube.surface.curves.features import NEAR, Crease, Features, covered, merged


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
