"""Improvement of the worst hexes: moving and fixed vertices, position of the boundary."""

import numpy as np
import pytest
import trimesh

from polycube.fitting.creases.constraints import goals, no_features
from polycube.fitting.local_polish import raise_worst, region
from polycube.fitting.problem import FitProblem
from polycube.fitting.registration import register_mesh
from polycube.fitting.springs import pull, together
from polycube.hexmesh.connectivity import hex_mesh
from polycube.surface.fit_target import target
from polycube.types import TriMesh
from tests.fixtures.fitting import cube, sphere
from tests.fixtures.hexmeshes import unit_cubes


@pytest.mark.parametrize(("rings", "moving", "near"), [(0, 2**3, 3**3), (1, 4**3, 5**3)])
def test_a_region_grows_by_rings(rings, moving, near):
    vertices, cubes = unit_cubes(7, 7, 7)
    middle = np.flatnonzero((vertices[cubes].mean(axis=1) == 3.5).all(axis=1))
    part = region(cubes, len(vertices), middle, rings)
    assert part.moves.sum() == moving
    assert len(part.hexes) == near
    assert np.array_equal(part.vertices[part.corners], cubes[part.hexes])


def test_every_hex_of_a_moving_vertex_is_in_the_region():
    vertices, cubes = unit_cubes(4, 3, 5)
    part = region(cubes, len(vertices), np.array([0, 17]), 1)
    moving = part.vertices[part.moves]
    assert set(np.flatnonzero(np.isin(cubes, moving).any(axis=1))) == set(part.hexes)


@pytest.fixture(scope="module")
def ball():
    """A cube's hexes fitted to a ball, boundary snapped: the hexes at its edges are flat."""
    surface = target(sphere())
    fitted = register_mesh(cube(5), surface, rounds=8, iterations=15)
    problem = FitProblem(fitted, surface, 500)
    x = surface.to_unit(fitted.vertices)
    x = _goals(problem, x).place(problem, x)
    _, quad_normals = problem.normals(x)
    cover = problem.cover(x, quad_normals, 0.03, np.full(len(x), 0.3), 0.0)
    return problem, x, problem.lengths(x, 2, 0.05), cover


def _goals(problem: FitProblem, x: np.ndarray):
    return goals(problem, x, no_features(), 0.04, np.ones(len(x), bool))


def test_the_worst_hex_improves_and_the_boundary_stays_on_the_surface(ball):
    problem, x, lengths, cover = ball
    y = raise_worst(problem, x, lengths, _goals(problem, x), cover, 40.0)
    assert problem.scaled_jacobian(y).min() > problem.scaled_jacobian(x).min() + 0.02
    there = np.linalg.norm(_goals(problem, x).place(problem, x) - x, axis=1) < 1e-6
    slid = np.intersect1d(problem.outer, np.flatnonzero(there & (x != y).any(axis=1)))
    off = np.linalg.norm(problem.target.closest(y[slid])[0] - y[slid], axis=1)
    assert len(slid) > 20
    assert off.max() < 1e-9


def test_other_vertices_do_not_move(ball):
    problem, x, lengths, cover = ball
    one = x.copy()
    inner = np.setdiff1d(np.arange(len(x)), problem.outer)
    centre = inner[np.linalg.norm(x[inner] - x.mean(axis=0), axis=1).argmin()]
    one[centre] += [0.095, 0, 0]  # far worse than the hexes at the boundary
    y = raise_worst(problem, one, lengths, _goals(problem, one), cover, 40.0)
    jacobian = problem.scaled_jacobian(one)
    seeds = np.flatnonzero(jacobian < jacobian.min() + 0.1)
    part = region(problem.hexes, len(x), seeds, 1)
    still = np.setdiff1d(np.arange(len(x)), part.vertices[part.moves])
    assert len(seeds) < 10
    assert len(still) > 0
    assert np.array_equal(y[still], one[still])
    assert problem.scaled_jacobian(y).min() > jacobian.min()


def test_vertices_off_the_surface_approach_it(ball):
    problem, x, lengths, cover = ball
    off = x.copy()
    worst = problem.hexes[problem.scaled_jacobian(x).argmin()]
    vertex = np.intersect1d(worst, problem.outer)[0]
    off[vertex] *= 0.98
    y = raise_worst(problem, off, lengths, _goals(problem, off), cover, 40.0)

    def gap(z):
        return np.linalg.norm(z[vertex] - problem.target.closest(z[[vertex]])[0][0])

    assert gap(y) < 0.7 * gap(off)


def test_a_perfect_mesh_is_unchanged():
    vertices, cubes = unit_cubes(3, 3, 3)
    solid = trimesh.creation.box(bounds=[[0, 0, 0], [3, 3, 3]])
    goal = target(TriMesh(solid.vertices, solid.faces))
    problem = FitProblem(hex_mesh(vertices, cubes), goal, 200)
    x = goal.to_unit(problem.mesh.vertices)
    cover = problem.cover(x, problem.normals(x)[1], 0.03, np.ones(len(x)), 0.0)
    y = raise_worst(problem, x, problem.lengths(x, 2, 0.05), _goals(problem, x), cover, 40.0)
    assert problem.scaled_jacobian(y).min() == pytest.approx(1, abs=1e-6)


def test_a_pull_along_a_plane_moves_its_vertex_on_the_surface(ball):
    """Springs without force in one direction are used too; the vertex slides."""
    problem, x, lengths, cover = ball
    worst = problem.hexes[problem.scaled_jacobian(x).argmin()]
    vertex = np.intersect1d(worst, problem.outer)[:1]
    aside = np.cross(x[vertex], [0.3, 0.5, 0.8])
    goal = x[vertex] + 0.02 * aside / np.linalg.norm(aside)
    up = x[vertex] / np.linalg.norm(x[vertex])
    strong = np.full(1, 1e4)
    springs = together([cover, pull(vertex, goal, up, -strong, strong)])
    free = raise_worst(problem, x, lengths, _goals(problem, x), cover, 40.0)
    pulled = raise_worst(problem, x, lengths, _goals(problem, x), springs, 40.0)

    def gap(z):
        return np.linalg.norm(z[vertex] - goal)

    assert gap(pulled) < 0.3 * gap(free)
    assert np.linalg.norm(problem.target.closest(pulled[vertex])[0] - pulled[vertex]) < 1e-9
