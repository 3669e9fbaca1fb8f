import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycube.surface.frames import rotations
from polycube.surface.measures import volume
from polycube.surface.voxels import voxels
from tests.fixtures.surfaces import box, joined, torus


def test_a_box_fills_its_voxels_exactly():
    found = voxels(box((1, 1, 1), (9, 5, 3)), np.eye(3), 16)
    expected = np.zeros((18, 10, 6), bool)
    expected[1:-1, 1:-1, 1:-1] = True
    np.testing.assert_array_equal(found.solid, expected)
    assert found.size == 0.5
    np.testing.assert_allclose(found.origin, 0.5)


def test_the_volume_converges():
    errors = []
    for resolution in (24, 96):
        found = voxels(torus(), Rotation.from_rotvec([0.3, 0.5, 0.7]).as_matrix(), resolution)
        errors.append(abs(found.solid.sum() * found.size**3 / volume(torus()) - 1))
    assert errors[1] < 0.005 and errors[1] < errors[0]


def test_a_void_is_empty():
    inner = box((1, 1, 1), (2, 2, 2))
    hollow = joined(box(high=(3, 3, 3)), type(inner)(inner.vertices, inner.faces[:, ::-1]))
    found = voxels(hollow, np.eye(3), 12)
    assert found.solid.sum() == 12**3 - 4**3


@pytest.mark.parametrize("rotation", rotations()[[1, 7, 12, 23]])
def test_turned_voxels_lie_where_the_turned_surface_lies(rotation):
    surface = box((1, 2, 3), (9, 6, 5))
    there = voxels(surface, np.eye(3), 16).turned(rotation)
    here = voxels(surface, rotation, 16)
    np.testing.assert_array_equal(there.solid, here.solid)
    np.testing.assert_allclose(there.origin, here.origin)
    assert there.size == here.size
