"""Edges between planes at 36 to 46 degrees: those of chamfers, not those of facets."""

import numpy as np
import pytest
import trimesh

from polycube.surface.curves.creases import features
from polycube.surface.measures import face_normals
from polycube.types import TriMesh


def prism(outline) -> TriMesh:
    """An upright convex prism of height 1, at unit scale."""
    mesh = trimesh.convex.convex_hull([(x, y, z) for x, y in outline for z in (0.0, 1.0)])
    points = mesh.vertices / np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    return TriMesh(points, mesh.faces)


def upright(surface):
    """Number of straight creases along z."""
    found = features(surface, face_normals(surface)).creases
    ends = np.array([c.points[-1] - c.points[0] for c in found if not c.is_loop])
    return int((abs(ends[:, 2]) > 0.9 * np.linalg.norm(ends, axis=1)).sum())


def rounded(pieces, radius=0.4):
    """A unit square with a corner that turns in so many pieces."""
    turn = (np.arange(pieces + 1) * np.pi / 2) / pieces
    arc = (1 - radius) + radius * np.column_stack([np.cos(turn), np.sin(turn)])
    return [(0, 0), (1, 0), *arc.tolist(), (0, 1)]


def test_a_chamfer_of_45_degrees_has_two():
    assert upright(prism(rounded(1))) == 5


@pytest.mark.parametrize("pieces", [3, 4, 12])
def test_a_round_corner_has_none(pieces):
    assert upright(prism(rounded(pieces))) == 3


@pytest.mark.parametrize("sections", [8, 9, 10, 20])
def test_a_round_prism_has_none(sections):
    angle = 2 * np.pi * np.arange(sections) / sections
    surface = prism(np.column_stack([np.cos(angle), np.sin(angle)]))
    assert all(c.is_loop for c in features(surface, face_normals(surface)).creases)


@pytest.mark.parametrize(("degrees", "count"), [(30, 4), (40, 5)])
def test_one_bend_is_an_edge_from_36_degrees(degrees, count):
    bend = np.radians(degrees)
    tip = [1 - np.sin(bend), 1 + np.cos(bend)]
    assert upright(prism([(0, 0), (1, 0), (1, 1), tip, (0, tip[1])])) == count


def test_small_planes_among_curved_ones_are_facets():
    ball = trimesh.creation.icosphere(1)
    surface = TriMesh(ball.vertices / 3.5, ball.faces)
    assert not features(surface, face_normals(surface)).creases
