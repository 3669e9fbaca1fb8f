"""Thickness against the dimensions of plates, tubes, balls and wedges."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from polycube.surface.feature_size import thickness
from polycube.surface.measures import spread
from polycube.types import TriMesh
from tests.fixtures.surfaces import box, joined


def tri(mesh: trimesh.Trimesh) -> TriMesh:
    return TriMesh(mesh.vertices, mesh.faces)


@pytest.mark.parametrize("size", [(10, 10, 10), (200, 100, 2), (50, 3, 3), (1e4, 1e4, 10)])
def test_a_block_is_as_thick_as_its_smallest_side_on_all_faces_edges_and_corners(size):
    block = box((5, 5, 5), np.add(5, size))
    ends = block.vertices[block.faces]
    edges = (ends + np.roll(ends, 1, axis=1)).reshape(-1, 3) / 2
    points = np.concatenate([spread(block, 300)[0], block.vertices, edges])
    assert thickness(block, points) == pytest.approx(min(size), rel=1e-6)


def test_a_ball_is_as_thick_as_its_diameter():
    ball = tri(trimesh.creation.icosphere(subdivisions=3, radius=5))
    assert thickness(ball, spread(ball, 100)[0]) == pytest.approx(10, rel=0.06)


def test_a_tube_is_as_thick_as_its_wall_even_on_its_ends():
    tube = tri(trimesh.creation.annulus(15, 20, 100, sections=96))
    assert thickness(tube, spread(tube, 500)[0]) == pytest.approx(5, rel=0.01)


def test_a_rod_is_as_thick_as_its_diameter_even_on_its_ends():
    rod = tri(trimesh.creation.cylinder(4, 60, sections=64))
    assert thickness(rod, spread(rod, 500)[0]) == pytest.approx(8, rel=0.02)


def test_a_wedge_is_as_thick_as_its_faces_are_apart():
    """Of 30 degrees: the chord between points of both faces that are equally far from the tip."""
    length, half = 30.0, 30 * np.tan(np.pi / 12)
    corners = np.array([[0, 0, 0], [length, -half, 0], [length, half, 0]])
    vertices = np.concatenate([corners, corners + np.array([0, 0, 60])])
    faces = [[0, 2, 1], [3, 4, 5], [0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5]]
    x = np.linspace(1, 15, 50)
    points = np.column_stack([x, x * np.tan(np.pi / 12), np.full(50, 30.0)])
    expected = 2 * x * np.tan(np.pi / 12)
    assert thickness(TriMesh(vertices, faces), points) == pytest.approx(expected, rel=0.12)


def test_a_rib_is_thin_on_a_thick_block():
    solid = joined(box((0, 0, 0), (40, 40, 20)), box((19, 0, 20.01), (21, 40, 30)))
    rib, block = [[21.0, 20, 27], [20.3, 20, 30]], [[5.0, 20, 20], [0, 20, 10]]
    assert thickness(solid, np.array(rib)) == pytest.approx(2)
    assert thickness(solid, np.array(block)) == pytest.approx(20)


def test_turned_scaled_and_placed_anywhere():
    turn = Rotation.random(random_state=0).as_matrix()
    plate = box((0, 0, 0), (30, 20, 1))
    points = spread(plate, 200)[0]
    moved = TriMesh(1e-3 * plate.vertices @ turn.T + 7, plate.faces)
    found = thickness(moved, 1e-3 * points @ turn.T + 7)
    assert found == pytest.approx(1e-3, rel=1e-6)
