"""Curves that leave a corner together: a common path, a fork, and the rest of both."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.surface.curves.cusps import BLEND, MOST, OFF, without_cusps
from polycube.surface.curves.features import NEAR, Crease, Features


def curve(points: np.ndarray, ends: tuple[int, int], faces: tuple[int, int]) -> Crease:
    arc = np.append(0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    return Crease(points, arc, np.full(len(arc) - 1, 0.5 * np.pi), ends, faces)


def wedge(angle: float, turned: bool = False, faces: tuple[int, int] = (2, 3)) -> Features:
    """Two straight curves of length 0.5 from one corner; face 1 is between them."""
    far = 0.5 * np.array([[np.cos(angle), np.sin(angle), 0], [1, 0, 0]])
    one = curve(np.linspace([0, 0, 0], far[0], 11), (0, 1), (1, faces[0]))
    two = curve(np.linspace([0, 0, 0], far[1], 11), (0, 2), (1, faces[1]))
    if turned:
        two = curve(two.points[::-1], (2, 0), two.faces)
    return Features((one, two), np.vstack([[0, 0, 0], far]), np.ones(3, bool), np.zeros((0, 2)), 3)


@pytest.mark.parametrize("turned", [False, True])
def test_the_fork_of_a_wedge_lies_in_its_middle_where_it_is_twice_the_distance_wide(turned) -> None:
    angle = np.deg2rad(5)
    found = without_cusps(wedge(angle, turned))
    one, two, common = found.creases
    length = OFF / np.sin(angle / 2)  # along either curve
    middle = np.array([np.cos(angle / 2), np.sin(angle / 2), 0])
    assert found.corners[3] == pytest.approx(length * np.cos(angle / 2) * middle, abs=1e-3)
    assert common.points[0] == pytest.approx([0, 0, 0])
    assert common.points[-1] == pytest.approx(found.corners[3])
    assert common.ends == (0, 3) and common.faces == (2, 3)
    assert common.inside == pytest.approx(0)  # 90 + 90 - 180 degrees
    assert 0.9 * OFF < common.off <= OFF
    assert one.ends == (3, 1) and two.ends == ((2, 3) if turned else (3, 2))
    assert found.is_fixed.tolist() == [True] * 4
    for own, before in ((one, wedge(angle).creases[0]), (two, wedge(angle).creases[1])):
        ends = own.points[[0, -1]][:: -1 if own is two and turned else 1]
        assert ends[0] == pytest.approx(found.corners[3]) and ends[1] == pytest.approx(
            before.points[-1]
        )
        far = own.points[np.linalg.norm(own.points, axis=1) > BLEND * length - 1e-9]
        assert before.nearest(far)[1] == pytest.approx(0, abs=1e-12)


def test_a_curve_that_lies_on_the_other_shares_its_whole_path_instead() -> None:
    """At its end it is 0.9 of the distance away within which curves coincide."""
    before = wedge(0.9 * NEAR / 0.5)
    assert without_cusps(before).creases == before.creases


@settings(deadline=None)
@given(st.floats(1.001 * NEAR / 0.5, np.deg2rad(7)))  # below, they coincide
def test_a_common_path_is_near_both_curves_and_no_longer_than_allowed(angle) -> None:
    before = wedge(angle)
    common = without_cusps(before).creases[2]
    for own in before.creases:
        assert own.nearest(common.points)[1].max() <= OFF * 1.0001
    assert common.length <= MOST * 0.5


def test_curves_that_part_soon_or_have_no_face_between_them_are_as_before() -> None:
    wide, apart = wedge(np.deg2rad(20)), wedge(np.deg2rad(5))
    assert without_cusps(wide) is wide
    other = curve(apart.creases[1].points, (0, 2), (4, 5))
    apart = Features((apart.creases[0], other), apart.corners, apart.is_fixed, apart.noise, 5)
    assert without_cusps(apart) is apart
    same = wedge(np.deg2rad(5), faces=(2, 2))
    assert without_cusps(same) is same


def test_a_surface_of_triangles_alone_keeps_its_curves() -> None:
    before = wedge(np.deg2rad(5))
    before = Features(before.creases, before.corners, before.is_fixed, before.noise)
    assert without_cusps(before) is before


def test_of_three_curves_that_leave_together_two_are_one() -> None:
    two = wedge(np.deg2rad(4))
    third = curve(
        np.linspace([0, 0, 0], 0.5 * np.array([np.cos(0.1), -np.sin(0.1), 0]), 11), (0, 3), (3, 4)
    )
    corners = np.vstack([two.corners, third.points[-1:]])
    before = Features((*two.creases, third), corners, np.ones(4, bool), two.noise, 4)
    found = without_cusps(before)
    assert len(found.creases) == 4 and found.creases[2] is third
