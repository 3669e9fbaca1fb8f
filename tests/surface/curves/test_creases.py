"""The graph of sharp edges: known solids, noise, facets."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.surface.curves.creases import _without_noise, features
from polycube.surface.curves.features import Crease
from polycube.surface.measures import face_normals
from polycube.types import TriMesh
from tests.fixtures.surfaces import box, circle, halved_box, joined, torus


def graph(surface: TriMesh | trimesh.Trimesh):
    """Features at the scale of the surface."""
    mesh = surface if isinstance(surface, TriMesh) else TriMesh(surface.vertices, surface.faces)
    return features(mesh, face_normals(mesh))


def test_cube_has_twelve_creases_and_eight_corners():
    found = graph(box())
    assert [len(c.points) for c in found.creases] == [2] * 12
    assert [c.length for c in found.creases] == [1] * 12
    assert np.concatenate([c.inside for c in found.creases]) == pytest.approx(np.pi / 2)
    assert len(found.corners) == 8 and found.is_fixed.all()
    ends = np.array([found.corners[list(c.ends)] for c in found.creases])
    points = np.array([c.points for c in found.creases])
    assert np.array_equal(ends, points)


def test_a_cube_in_a_cube_is_concave_from_the_solid():
    outer, inner = box(), box((0.25,) * 3, (0.75,) * 3)
    hollow = joined(outer, TriMesh(inner.vertices, inner.faces[:, ::-1]))
    inside = np.concatenate([c.inside for c in graph(hollow).creases])
    assert np.sort(inside) == pytest.approx(np.repeat([np.pi / 2, 3 * np.pi / 2], 12))


@pytest.mark.parametrize("sections", [12, 32])
def test_rims_of_a_cylinder_are_loops_and_its_facets_are_none(sections):
    found = graph(trimesh.creation.cylinder(radius=0.3, height=1, sections=sections))
    assert [c.is_loop for c in found.creases] == [True, True]
    assert [len(c.inside) for c in found.creases] == [sections] * 2
    assert len(found.corners) == 0


def test_eight_facets_of_45_degrees_are_none_and_six_are_sharp():
    assert [c.is_loop for c in graph(_prism(8)).creases] == [True, True]
    assert len(graph(_prism(6)).creases) == 18


def _prism(sections: int) -> trimesh.Trimesh:
    return trimesh.creation.cylinder(radius=0.3, height=1, sections=sections)


def test_smooth_surfaces_have_none():
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.5)
    assert graph(ball).creases == graph(torus()).creases == ()
    assert graph(torus()).corners.shape == (0, 3)


def test_kinks_are_corners():
    """A flat pyramid: only the rim of its base is sharp, and turns at four corners."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0.1]])
    faces = [[0, 2, 1], [0, 3, 2], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    found = graph(TriMesh(corners, np.array(faces)))
    assert [c.length for c in found.creases] == [1] * 4
    assert sorted(found.corners.tolist()) == sorted(corners[:4].tolist())


def test_short_pieces_and_loose_ends_are_noise():
    """Four long edges in a row with a spur of 0.05, and far away a scratch of 0.04."""
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0], [4, 0, 0]], float)
    points = np.vstack([points, [[2, 0.05, 0], [9, 0, 0], [9, 0.04, 0]]])
    sides = np.array([[0, 1], [1, 2], [2, 3], [3, 4], [2, 5], [6, 7]])
    every = np.ones(6, bool)
    remains = _without_noise(points, sides, every, ~every)
    assert remains.tolist() == [True] * 4 + [False] * 2
    remains = _without_noise(points, sides, every, np.arange(6) == 5)  # the scratch: a CAD curve
    assert remains.tolist() == [True] * 4 + [False, True]
    points[5, 1] = 0.07
    assert _without_noise(points, sides, every, ~every).sum() == 5


@pytest.mark.parametrize(("broad", "n_remaining"), [([0, 1, 1, 1], 4), ([0, 0, 0, 1], 0)])
def test_a_crease_of_which_most_is_sharp_from_near_only_is_noise(broad, n_remaining):
    points = np.arange(5.0)[:, None] * [1, 0, 0]
    sides = np.stack([np.arange(4), np.arange(1, 5)], axis=1)
    found = _without_noise(points, sides, np.array(broad, bool), np.zeros(4, bool))
    assert found.sum() == n_remaining


@given(st.integers(0, 10**6))
@settings(max_examples=20, deadline=None)
@pytest.mark.slow
def test_numbering_of_the_surface_does_not_matter(seed):
    rng = np.random.default_rng(seed)
    surface = joined(box(), box((2, 0, 0), (3, 1, 0.5)))
    place = rng.permutation(len(surface.vertices))
    vertices = np.empty_like(surface.vertices)
    vertices[place] = surface.vertices
    faces = np.stack([np.roll(f, rng.integers(3)) for f in place[surface.faces]])
    found = graph(TriMesh(vertices, rng.permutation(faces)))
    assert len(found.creases) == 24 and len(found.corners) == 16
    assert sum(c.length for c in found.creases) == pytest.approx(12 + 8 + 2)


@given(st.integers(0, 10**6))
@settings(max_examples=20, deadline=None)
def test_nearest_on_a_crease_is_no_farther_than_any_of_its_points(seed):
    rng = np.random.default_rng(seed)
    crease, points = circle(20), rng.normal(size=(8, 3))
    arc, gap = crease.nearest(points)
    assert np.linalg.norm(points - crease.at(arc)[0], axis=1) == pytest.approx(gap)
    every = crease.at(np.linspace(0, crease.length, 2000))[0]
    slow = np.linalg.norm(points[:, None] - every, axis=2).min(axis=1)
    assert (gap <= slow + 1e-12).all()
    assert gap == pytest.approx(slow, abs=1e-2)


def test_expected_arc_tells_branches_apart():
    """A hairpin: the far branch is nearer, but the path has been there already."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 0.1, 0], [0, 0.1, 0.0]])
    hairpin = Crease(points, np.array([0, 1, 1.1, 2.1]), np.ones(3), (0, 1))
    place = np.array([[0.5, 0.04, 0]])
    assert hairpin.nearest(place)[0] == pytest.approx([0.5])
    assert hairpin.nearest(place, np.array([1.6]))[0] == pytest.approx([1.6])


def test_a_loop_goes_on_beyond_its_length():
    crease = circle()
    arc, _ = crease.nearest(crease.points[[10]], np.array([crease.length]))
    assert arc == pytest.approx(crease.length + crease.arc[10])
    assert crease.at(arc)[0] == pytest.approx(crease.points[[10]])


@given(st.integers(0, 3), st.floats(-0.1, 0.1), st.floats(-0.5, 0.5))
@settings(max_examples=40, deadline=None)
def test_a_point_on_a_crease_is_its_own_answer(corner, distance, off):
    """Near a corner of a square, wherever about it the path expects the point."""
    points = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [0.0, 0, 0]])
    square = Crease(points, np.arange(0, 10.0, 2), np.full(4, np.pi / 2), (-1, -1))
    arc = 2.0 * corner + distance
    found, gap = square.nearest(square.at(np.array([arc]))[0], np.array([arc + off]))
    assert found == pytest.approx(arc, abs=1e-7) and gap == pytest.approx(0, abs=1e-7)


def test_borders_of_cad_faces_are_curves_whatever_the_angle():
    """The top of a box in two CAD faces: one more curve, flat, and two more corners."""
    surface = halved_box()
    found = graph(surface)
    assert len(found.creases) == 15 and len(found.corners) == 10 and found.n_faces == 7
    flat = [c for c in found.creases if abs(c.inside[0] - np.pi) < 1e-9]
    assert [c.faces for c in flat] == [(6, 7)]
    between = sorted(c.faces for c in found.creases)
    assert len(set(between)) == 15 and all(a < b for a, b in between)


def test_a_seam_inside_a_cad_face_is_no_curve():
    surface = halved_box()
    one = TriMesh(surface.vertices, surface.faces, np.minimum(surface.region, 6))
    assert len(graph(one).creases) == 12
