"""Points are checked, and freed of outliers that are known."""

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.surface.clouds.points import checked, spacings, with_normals, without_outliers
from tests.fixtures.clouds import ball_points, cloud

GRID = np.stack(np.meshgrid(*[np.arange(6.0)] * 3), axis=-1).reshape(-1, 3)


def test_the_spacing_of_a_grid_is_its_step():
    inner = (GRID > 0).all(axis=1) & (GRID < 5).all(axis=1)
    assert spacings(GRID)[inner] == pytest.approx(1)


def test_equal_points_and_such_that_are_no_numbers_are_dropped():
    points = ball_points(200)
    given = np.concatenate([points, points[:7], [[np.nan, 0, 0], [0, np.inf, 0]]])
    assert np.array_equal(checked(cloud(given)).points, points)


def test_normals_become_unit_and_incomplete_ones_are_dropped():
    points = ball_points(200)
    assert checked(cloud(points, 3 * points)).normals == pytest.approx(points)
    assert not len(checked(cloud(points, np.where(points[:, :1] > 0.9, 0, points))).normals)


@pytest.mark.parametrize(
    ("points", "sentence"),
    [
        (ball_points(99), "99 distinct points"),
        (ball_points(200) * [1, 1, 0], "in one plane"),
        (ball_points(200) * [1, 0, 0], "on one line"),
        (ball_points(200) * 1e200, "out of range"),
        (np.full((200, 3), np.nan), "200 are not finite"),
    ],
)
def test_points_that_bound_no_solid_are_refused(points, sentence):
    with pytest.raises(InputError, match=sentence):
        checked(cloud(points))


def test_far_points_are_removed_and_hardly_any_others():
    points = ball_points(2000, outliers=40)
    far = np.abs(np.linalg.norm(points, axis=1) - 1) > 0.2
    left = without_outliers(cloud(points), 3.0).points
    assert not (np.abs(np.linalg.norm(left, axis=1) - 1) > 0.2).any()
    assert len(left) > 0.98 * (~far).sum()


def test_normals_of_a_sphere_are_radial_and_all_on_one_side():
    pytest.importorskip("open3d", exc_type=ImportError)
    found = with_normals(cloud(ball_points(2000)), 30)
    along = np.einsum("ni,ni->n", found.normals, found.points)
    assert np.abs(along).min() > 0.99
    assert len(set(np.sign(along))) == 1
