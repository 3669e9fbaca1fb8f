"""Points in a surface, on grids of any spacing."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.surface.voxels import inside
from tests.fixtures.surfaces import box, joined

BALL = np.array(trimesh.creation.icosphere(4).triangles)


def test_a_box_on_the_grid_lines_is_exact():
    x = np.array([-0.5, 0.0, 0.3, 0.9, 1.5])
    surface = box()
    found = inside(surface.vertices[surface.faces], x, x + 1e-3, x + 1e-3)
    within = (x >= 0) & (x < 1)
    expected = within[:, None, None] & within[:, None] & within
    assert (found[1:] == expected[1:]).all()


@settings(deadline=None)
@given(seed=st.integers(0, 10**6))
def test_points_of_a_ball(seed):
    rng = np.random.default_rng(seed)
    x, y, z = (np.sort(rng.uniform(-1.2, 1.2, n)) for n in (7, 5, 9))
    found = inside(BALL, x, y, z)
    radius = np.linalg.norm(np.stack(np.meshgrid(x, y, z, indexing="ij"), -1), axis=-1)
    sure = abs(radius - 1) > 0.01
    assert (found[sure] == (radius[sure] < 1)).all()


def test_a_cavity_is_outside():
    inner = box((0.25,) * 3, (0.75,) * 3)
    surface = joined(box(), type(inner)(inner.vertices, inner.faces[:, ::-1]))
    at = np.array([0.1, 0.5, 0.9])
    found = inside(surface.vertices[surface.faces], at, at, at)
    assert not found[1, 1, 1]
    assert found.sum() == 26


@pytest.mark.parametrize("axis", range(3))
def test_one_point_an_axis_will_do(axis):
    surface = box()
    grid = [np.array([0.5])] * 3
    grid[axis] = np.array([-1.0, 0.5])
    assert inside(surface.vertices[surface.faces], *grid).ravel().tolist() == [False, True]
