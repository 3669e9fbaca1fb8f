"""Rough maps from registered meshes."""

import numpy as np
import pytest
import trimesh

from polycube.fitting.registration import cascade, registered_map
from polycube.hexmesh.generation.template import counts, grid_lines, mesh
from polycube.hexmesh.quality import deviation
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.structure.rough_map import affine_map, evaluate, identity_map
from polycube.surface.fit_target import target
from polycube.types import Polycube, TriMesh
from tests.fixtures.polycubes import ring


def washer() -> TriMesh:
    part = trimesh.creation.annulus(r_min=0.2, r_max=0.55, height=1, sections=48)
    part.apply_translation([0.5, 0.5, 0.5])
    return TriMesh(part.vertices, part.faces)


def test_lines_of_the_grid():
    x, y, z = grid_lines(ring(), (np.array([1, 2, 1]), np.array([2, 2, 2]), np.array([4])))
    assert x == pytest.approx([0, 1 / 3, 1 / 2, 2 / 3, 1])
    assert y == pytest.approx(np.arange(7) / 6)
    assert z == pytest.approx(np.arange(5) / 4)


def test_the_map_of_the_template_is_the_registered_mesh():
    start = identity_map(ring())
    parts = counts(ring(), start, 0.25)
    placed = registered_map(ring(), start, target(washer()), parts)
    again = mesh(ring(), placed, parts)
    assert deviation(again, washer()).vertices < 0.01
    assert deviation(mesh(ring(), start, parts), washer()).vertices > 0.05
    hole = np.array([[0.5, 0.5, 0.5]])  # no vertex there: as before
    fine = mesh(ring(), placed, tuple(2 * n for n in parts))
    assert scaled_jacobian(fine.vertices, fine.hexes).min() > 0
    assert np.linalg.norm(evaluate(placed, hole) - hole) < 0.2


def test_levels_lie_between_the_sizes():
    goal = target(washer())
    start = identity_map(ring())
    for size, nearly in ((0.3, True), (0.26, True), (0.2, False), (0.1, False)):
        assert (cascade(ring(), start, goal, size, coarse=0.25) is start) == nearly


def test_a_fine_mesh_starts_on_the_surface():
    bar = Polycube(np.ones((1, 1, 1)), [0, 1], [0, 1], [0, 1], (1, 1, 1), ("cube",))
    ball = trimesh.creation.icosphere(subdivisions=3)
    surface = TriMesh(ball.vertices, ball.faces)
    start = affine_map(bar, 3 * np.eye(3), -1.5 * np.ones(3))
    placed = cascade(bar, start, target(surface), 0.2, coarse=0.5)
    fine = mesh(bar, placed, counts(bar, start, 0.2))
    assert deviation(fine, surface).vertices < 0.02
