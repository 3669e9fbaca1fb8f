"""Raising the worst hexes: what moves, what stays, and where the boundary lies afterwards."""

import numpy as np
import pytest
import trimesh

from polycube.fitting.body import Body
from polycube.fitting.creases.features import goals, no_features
from polycube.fitting.registration import register
from polycube.fitting.worst import raise_worst, region
from polycube.hexmesh.energy import pull, together
from polycube.hexmesh.hexes import hex_mesh
from polycube.surface.target import target
from polycube.types import TriMesh
from tests.fitting.test_registration import cube, sphere
from tests.hexmesh.test_hexes import box


@pytest.mark.parametrize(("rings", "moving", "near"), [(0, 2**3, 3**3), (1, 4**3, 5**3)])
def test_a_region_grows_by_rings(rings, moving, near):
    vertices, cubes = box(7, 7, 7)
    middle = np.flatnonzero((vertices[cubes].mean(axis=1) == 3.5).all(axis=1))
    part = region(cubes, len(vertices), middle, rings)
    assert part.moves.sum() == moving
    assert len(part.hexes) == near
    assert np.array_equal(part.vertices[part.corners], cubes[part.hexes])


def test_every_hex_of_a_moving_vertex_is_in_the_region():
    vertices, cubes = box(4, 3, 5)
    part = region(cubes, len(vertices), np.array([0, 17]), 1)
    moving = part.vertices[part.moves]
    assert set(np.flatnonzero(np.isin(cubes, moving).any(axis=1))) == set(part.hexes)


@pytest.fixture(scope="module")
def ball():
    """A cube's hexes fitted to a ball, boundary snapped: the hexes at its edges are flat."""
    surface = target(sphere())
    fitted = register(cube(5), surface, rounds=8, iterations=15)
    body = Body(fitted, surface, 500)
    x = surface.to_unit(fitted.vertices)
    x = _goals(body, x).place(body, x)
    _, quad_normals = body.normals(x)
    cover = body.cover(x, quad_normals, 0.03, np.full(len(x), 0.3), 0.0)
    return body, x, body.lengths(x, 2, 0.05), cover


def _goals(body: Body, x: np.ndarray):
    return goals(body, x, no_features(), 0.04, np.ones(len(x), bool))


def test_the_worst_rises_and_the_boundary_stays_on_the_surface(ball):
    body, x, lengths, cover = ball
    y = raise_worst(body, x, lengths, _goals(body, x), cover, 40.0)
    assert body.scaled_jacobian(y).min() > body.scaled_jacobian(x).min() + 0.02
    there = np.linalg.norm(_goals(body, x).place(body, x) - x, axis=1) < 1e-6
    slid = np.intersect1d(body.outer, np.flatnonzero(there & (x != y).any(axis=1)))
    off = np.linalg.norm(body.target.closest(y[slid])[0] - y[slid], axis=1)
    assert len(slid) > 20
    assert off.max() < 1e-9


def test_all_else_stays_where_it_was(ball):
    body, x, lengths, cover = ball
    one = x.copy()
    inner = np.setdiff1d(np.arange(len(x)), body.outer)
    centre = inner[np.linalg.norm(x[inner] - x.mean(axis=0), axis=1).argmin()]
    one[centre] += [0.095, 0, 0]  # far worse than the hexes at the boundary
    y = raise_worst(body, one, lengths, _goals(body, one), cover, 40.0)
    jacobian = body.scaled_jacobian(one)
    seeds = np.flatnonzero(jacobian < jacobian.min() + 0.1)
    part = region(body.hexes, len(x), seeds, 1)
    still = np.setdiff1d(np.arange(len(x)), part.vertices[part.moves])
    assert len(seeds) < 10
    assert len(still) > 0
    assert np.array_equal(y[still], one[still])
    assert body.scaled_jacobian(y).min() > jacobian.min()


def test_what_is_off_the_surface_comes_nearer(ball):
    body, x, lengths, cover = ball
    off = x.copy()
    worst = body.hexes[body.scaled_jacobian(x).argmin()]
    vertex = np.intersect1d(worst, body.outer)[0]
    off[vertex] *= 0.98
    y = raise_worst(body, off, lengths, _goals(body, off), cover, 40.0)

    def gap(z):
        return np.linalg.norm(z[vertex] - body.target.closest(z[[vertex]])[0][0])

    assert gap(y) < 0.7 * gap(off)


def test_a_perfect_mesh_is_left_alone():
    vertices, cubes = box(3, 3, 3)
    solid = trimesh.creation.box(bounds=[[0, 0, 0], [3, 3, 3]])
    goal = target(TriMesh(solid.vertices, solid.faces))
    body = Body(hex_mesh(vertices, cubes), goal, 200)
    x = goal.to_unit(body.mesh.vertices)
    cover = body.cover(x, body.normals(x)[1], 0.03, np.ones(len(x)), 0.0)
    y = raise_worst(body, x, body.lengths(x, 2, 0.05), _goals(body, x), cover, 40.0)
    assert body.scaled_jacobian(y).min() == pytest.approx(1, abs=1e-6)


def test_a_pull_along_a_plane_moves_its_vertex_on_the_surface(ball):
    """Springs that leave one direction free count too; the vertex slides."""
    body, x, lengths, cover = ball
    worst = body.hexes[body.scaled_jacobian(x).argmin()]
    vertex = np.intersect1d(worst, body.outer)[:1]
    aside = np.cross(x[vertex], [0.3, 0.5, 0.8])
    goal = x[vertex] + 0.02 * aside / np.linalg.norm(aside)
    up = x[vertex] / np.linalg.norm(x[vertex])
    strong = np.full(1, 1e4)
    springs = together([cover, pull(vertex, goal, up, -strong, strong)])
    free = raise_worst(body, x, lengths, _goals(body, x), cover, 40.0)
    pulled = raise_worst(body, x, lengths, _goals(body, x), springs, 40.0)

    def gap(z):
        return np.linalg.norm(z[vertex] - goal)

    assert gap(pulled) < 0.3 * gap(free)
    assert np.linalg.norm(body.target.closest(pulled[vertex])[0] - pulled[vertex]) < 1e-9
