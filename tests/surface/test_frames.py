import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycube.surface.frames import frames, rotations, turn
from polycube.types import TriMesh
from tests.fixtures.surfaces import box, torus


def test_the_cube_has_24_rotations():
    group = rotations()
    assert group.shape == (24, 3, 3)
    np.testing.assert_array_equal(np.linalg.det(group).round(), 1)
    flat = {tuple(matrix.astype(int).ravel()) for matrix in group}
    products = {tuple((a @ b).astype(int).ravel()) for a in group for b in group}
    assert len(flat) == 24 and products == flat


def test_turn_moves_boxes_as_it_moves_their_centres():
    boxes = np.random.default_rng(0).random((2, 3, 4)) < 0.5
    middle = (np.array(boxes.shape) - 1) / 2
    for rotation in rotations():
        turned = turn(boxes, rotation)
        moved = (np.argwhere(boxes) - middle) @ rotation.T
        expected = np.zeros(turned.shape, bool)
        expected[tuple((moved + (np.array(turned.shape) - 1) / 2).round().astype(int).T)] = True
        np.testing.assert_array_equal(turned, expected)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("sides", [(1, 1, 1), (3, 2, 1), (5, 5, 1)])
def test_the_best_frame_of_a_box_is_its_own(sides, seed):
    turned = Rotation.random(random_state=seed).as_matrix()
    surface = box(high=sides)
    found = frames(TriMesh(surface.vertices @ turned.T + 7, surface.faces))
    agreement = np.abs(found[0] @ turned)  # a signed permutation when the axes agree
    assert agreement.max(axis=1) == pytest.approx(1, abs=1e-3)
    for frame in found:
        assert np.linalg.det(frame) == pytest.approx(1)
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)


def test_frames_are_distinct_and_few():
    found = frames(torus())[:2]
    assert len(found) <= 2
    for i, a in enumerate(found):
        assert all((np.abs(a @ b.T).max(axis=1) < np.cos(np.radians(10))).any() for b in found[:i])
    assert [f.tolist() for f in frames(torus())] == [f.tolist() for f in frames(torus())]
