"""Motions between solids by their landmarks: found where there is one, and no reflections."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycube.io.solids.motions import EDGE, FACE, VERTEX, landmarks, motions

TURN = Rotation.from_rotvec([1.0, -2.0, 0.5]).as_matrix()
STEP = np.array([300.0, -20.0, 7.0])


def solid(points, keys, matrix=None, step=0, volume=1.0):
    """Landmarks of points (N, 3) that are the solid's mass too, moved."""
    matrix = np.eye(3) if matrix is None else matrix
    moved = points @ matrix.T + step
    off = moved - moved.mean(axis=0)
    inertia = (off**2).sum() * np.eye(3) - off.T @ off
    return landmarks(volume, moved.mean(axis=0), inertia, moved, keys)


@pytest.fixture
def cloud():
    """Six vertices, six edges and six faces without any symmetry."""
    rng = np.random.default_rng(3)
    sizes = np.concatenate([np.zeros(6), rng.uniform(1, 2, 12)])
    keys = np.stack([np.repeat([VERTEX, EDGE, FACE], 6), sizes, np.zeros(18)], axis=1)
    return rng.normal(size=(18, 3)) * [3, 2, 1], keys


def test_the_motion_of_a_copy_is_found_to_rounding_with_its_faces(cloud):
    points, keys = cloud
    order = np.random.default_rng(5).permutation(18)
    [found] = motions(solid(points, keys), solid(points[order], keys[order], TURN, STEP))
    np.testing.assert_allclose(found.rotation, TURN, atol=1e-12)
    np.testing.assert_allclose(found.translation, STEP, atol=1e-10)
    np.testing.assert_allclose(found(points), points @ TURN.T + STEP, atol=1e-10)
    own, other = np.flatnonzero(keys[:, 0] == FACE), order[keys[order, 0] == FACE]
    np.testing.assert_array_equal(other[found.faces], own)


def test_a_mirror_image_is_no_copy(cloud):
    points, keys = cloud
    assert not list(motions(solid(points, keys), solid(points, keys, np.diag([1, 1, -1]))))


@pytest.mark.parametrize("change", ["size", "place", "scale", "kind", "volume"])
def test_what_differs_in_one_thing_is_no_copy(cloud, change):
    points, keys = cloud
    other, named = points.copy(), keys.copy()
    if change == "size":
        named[17, 1] *= 1.001
    if change == "place":
        other[0] += 0.003
    if change == "scale":
        other *= 1.001
    if change == "kind":
        named[17, 2] = 1
    volume = 1.001 if change == "volume" else 1
    assert not list(motions(solid(points, keys), solid(other, named, volume=volume)))


def test_a_box_has_its_rotations_the_least_first():
    corners = np.array([(x, y, z) for x in (0, 3) for y in (0, 2) for z in (0, 1)], float)
    keys = np.tile([VERTEX, 0.0, 0.0], (8, 1))
    found = list(motions(solid(corners, keys), solid(corners, keys, step=STEP)))
    assert len(found) == 4  # half turns about three axes, and none
    np.testing.assert_allclose(found[0].rotation, np.eye(3), atol=1e-12)
    assert all(np.linalg.det(each.rotation) == pytest.approx(1) for each in found)


def test_landmarks_on_a_line_give_no_motion():
    """Nor does a ball without any, whose axes of inertia are not known."""
    line = np.array([[0, 0, -1.0], [0, 0, 0], [0, 0, 1]])
    keys = np.array([[VERTEX, 0, 0], [EDGE, 1, 0], [FACE, 2, 0]])
    bare = landmarks(1.0, np.zeros(3), np.eye(3), line, keys)
    assert not list(motions(bare, bare))


def test_the_axis_of_a_ring_is_a_landmark():
    """A ring has one vertex; the axis of inertia that is known makes the rotation definite."""
    ring = np.array([[12.0, 0, 0], [10, 0, 0], [0, 0, 0]])
    keys = np.array([[VERTEX, 0, 0], [EDGE, 12, 0], [FACE, 28, 5]])
    inertia = np.diag([5.0, 5.0, 9.0])
    turned = landmarks(1.0, STEP, TURN @ inertia @ TURN.T, ring @ TURN.T + STEP, keys)
    found = list(motions(landmarks(1.0, np.zeros(3), inertia, ring, keys), turned))
    assert len(found) == 2  # it may be turned over
    for each in found:
        np.testing.assert_allclose(each.rotation @ [12, 0, 0], TURN @ [12, 0, 0], atol=1e-9)
        assert abs(each.rotation[:, 2] @ TURN[:, 2]) == pytest.approx(1)
