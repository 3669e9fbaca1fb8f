"""Where hexes of a size are too large for the details of a surface."""

import numpy as np
import pytest

from polycube.surface.feature_size import detail_size, small_details, thickness, widths
from polycube.surface.fit_target import target
from tests.fixtures.machined import bored, prism
from tests.fixtures.surfaces import box, torus


def details(surface, size):
    """Points in model units; size in them too."""
    goal = target(surface)
    return goal.to_model(small_details(goal, size / goal.scale, 2, 8))


def test_the_room_in_a_bore_is_its_diameter():
    ring = torus()
    inner = np.array([[1.5, 0, 0], [0, 1.5, 0]])
    goal = target(ring)
    space = goal.scale * widths(goal, goal.to_unit(inner), outside=True)
    assert space == pytest.approx(3, rel=0.05)
    assert thickness(ring, inner) == pytest.approx(1, rel=0.05)


def test_walls_need_two_hexes_through_them():
    plate = box(high=(10, 8, 1))
    assert len(details(plate, 0.45)) == 0
    assert len(details(plate, 0.6)) > 2500


def test_short_curves_are_details():
    step = prism(([(0, 0), (6, 0), (6, 4), (0.8, 4), (0, 3.6)], [(0, 1, 2, 3, 4)]), 0, 4)
    near = details(step, 0.6)
    assert len(near)
    assert np.linalg.norm(near[:, :2] - (0.4, 3.8), axis=1).max() < 1.5
    assert len(details(step, 0.2)) == 0


def test_holes_need_eight_hexes_round_them():
    surface = bored()
    far = details(surface, 0.05)
    assert len(far) == 0
    assert len(details(surface, 0.5)) > 0


def test_the_size_for_details_follows_the_numbers_asked_for():
    goal = target(box(high=(10, 8, 1)))
    assert detail_size(goal, 2, 8) * goal.scale == pytest.approx(0.5, rel=0.02)
    assert detail_size(goal, 4, 8) * goal.scale == pytest.approx(0.25, rel=0.02)
