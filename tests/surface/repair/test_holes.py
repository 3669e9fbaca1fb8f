"""Holes: exact on plane polygons, closed and oriented on solids."""

import numpy as np
import pytest

from polycube.surface.checks import check_surface
from polycube.surface.measures import volume
from polycube.surface.repair.holes import filling, flatness, loops, nested
from polycube.types import TriMesh
from tests.fixtures.surfaces import box

ELL = np.array([[0, 0], [3, 0], [3, 1], [1, 1], [1, 3], [0, 3]], float)


def area_vectors(points, triangles):
    a, b, c = points[triangles].transpose(1, 0, 2)
    return np.cross(b - a, c - a) / 2


@pytest.mark.parametrize("turn", range(6))
def test_a_flat_hole_that_is_not_convex_is_covered_once(turn):
    points = np.roll(np.column_stack([ELL, np.zeros(6)]), turn, axis=0)
    areas = area_vectors(points, filling(points))[:, 2]
    assert (areas > 0).all()  # no triangle lies over another
    assert areas.sum() == pytest.approx(5)


def test_a_bent_quad_is_cut_along_the_diagonal_of_least_area():
    points = np.array([[0, 0, 0], [1, 0, 0.0], [1, 1, 5], [0, 1, 0]])
    triangles = filling(points)
    areas = np.linalg.norm(area_vectors(points, triangles), axis=1).sum()
    other = np.linalg.norm(area_vectors(points, np.array([[0, 1, 2], [0, 2, 3]])), axis=1).sum()
    assert areas < other


def test_faces_taken_out_of_a_box_are_put_back():
    solid = box()
    open_box = TriMesh(solid.vertices, solid.faces[2:])
    [loop] = loops(open_box.faces)
    faces = np.concatenate([open_box.faces, loop[filling(open_box.vertices[loop])]])
    closed = TriMesh(open_box.vertices, faces)
    check_surface(closed)
    assert volume(closed) == pytest.approx(volume(solid), rel=1e-12)
    assert flatness(open_box.vertices[loop]) < 1e-12


def test_a_loop_within_another_is_recognized():
    ring = np.column_stack([ELL, np.zeros(6)])
    surface = TriMesh(
        np.concatenate([ring, 0.5 * ring + [0.2, 0.2, 0], ring + 10]), np.zeros((0, 3))
    )
    found = [np.arange(6), np.arange(6, 12), np.arange(12, 18)]
    assert nested(surface, found).tolist() == [True, True, False]
