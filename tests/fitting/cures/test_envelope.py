"""A neighbourhood with its boundary in an envelope of the surface."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.fitting.cures.envelope import (
    INSIDE,
    _inward,
    _permitted_distance,
    _within_distance,
    evaluated,
    fit_in_envelope,
)
from polycube.fitting.cures.fitted import fitted
from polycube.fitting.cures.neighbourhood import neighbourhood
from polycube.fitting.snapping import goals_of
from polycube.hexmesh.connectivity import hex_mesh
from polycube.surface.fit_target import target
from tests.fixtures.cures import lattice_on_rod
from tests.fixtures.hexmeshes import unit_cubes
from tests.fixtures.surfaces import box

AIM = 0.4
WIDTHS = (0.0, 0.0005, 0.0015)


@pytest.fixture(scope="module")
def near():
    surface, mesh = lattice_on_rod()
    fit = fitted(mesh, target(surface))
    return neighbourhood(fit, np.flatnonzero(fit.jacobian < fit.jacobian.min() + 0.05)[:1])


@pytest.fixture(scope="module")
def found(near):
    return {width: fit_in_envelope(near, AIM, width, none(near))[0] for width in WIDTHS}


def none(near):
    return np.zeros(len(near.moves), bool)


def away(near, x):
    at = goals_of(near.problem, x, near.matching, np.ones(len(x)))
    return np.linalg.norm(at.place(near.problem, x) - x, axis=1)


@pytest.mark.parametrize("width", WIDTHS)
def test_the_boundary_is_in_the_envelope(near, found, width):
    start = near.problem.mesh.vertices
    allowed = np.maximum(width, away(near, start))
    assert (away(near, found[width].x) <= allowed + 1e-6).all()
    assert found[width].strayed.max() < 1e-12


def test_vertices_at_the_limit_of_a_curve_do_not_spoil_the_fit(found):
    assert found[0.0015].least > 0.33


def test_each_vertex_has_its_own_envelope(near):
    start = near.problem.mesh.vertices
    width = np.where(np.arange(len(start)) % 2, 0.0015, 0.0)
    _, found = fit_in_envelope(near, AIM, width, none(near))
    allowed = np.maximum(width, away(near, start))
    assert (away(near, found.x) <= allowed + 1e-6).all()
    assert (away(near, found.x) > 0.0005).any()


@pytest.mark.parametrize("width", WIDTHS)
def test_vertices_around_the_neighbourhood_are_fixed(near, found, width):
    start = near.problem.mesh.vertices
    assert np.array_equal(found[width].x[~near.moves], start[~near.moves])


def test_poor_hexes_cost_less(near, found):
    start = near.problem.mesh.vertices
    costs = [evaluated(near, start, AIM).cost, *(found[width].cost for width in WIDTHS)]
    assert max(costs[1:]) < 0.6 * costs[0]


@pytest.mark.parametrize("on_surface", [False, True])
@pytest.mark.parametrize("more", [0.001, 0.02, 0.1])
def test_positions_that_are_not_moved_back_cost_no_more_than_before(near, more, on_surface):
    start = evaluated(near, near.problem.mesh.vertices, AIM)
    aim = start.least + more
    returned, found = fit_in_envelope(near, aim, 0.0015, none(near), on_surface)
    assert found.cost <= evaluated(near, start.x, aim).cost
    assert returned.least >= min(aim, found.least) - 0.002
    assert away(near, returned.x).sum() <= away(near, found.x).sum() + 1e-9


def test_held_vertices_do_not_move(near):
    start, held = near.problem.mesh.vertices, none(near)
    held[np.flatnonzero(near.moves)[::3]] = True
    found, _ = fit_in_envelope(near, AIM, 0.0015, held)
    assert np.array_equal(found.x[held], start[held])
    assert not np.array_equal(found.x, start)


def test_a_neighbourhood_without_boundary_is_improved():
    vertices, hexes = unit_cubes(13, 13, 13)
    middle = np.flatnonzero((vertices == 6).all(axis=1))
    vertices[middle] += 0.3
    fit = fitted(hex_mesh(vertices, hexes), target(box(high=(13, 13, 13))))
    inner = neighbourhood(fit, np.flatnonzero((hexes == middle).any(axis=1))[:1])
    assert not len(inner.problem.outer)
    before = evaluated(inner, inner.problem.mesh.vertices, AIM)
    assert 0 < before.least < AIM <= fit_in_envelope(inner, AIM, 0.0005, none(inner))[0].least


@pytest.mark.parametrize("across", [1, 2, 3])
def test_a_projected_step_stays_within_the_limits_to_first_order(across):
    """And it is the whole step for vertices that are inside, or move inwards."""
    rng = np.random.default_rng(across)
    axes = np.linalg.qr(rng.standard_normal((40, 3, 3)))[0][:, :, :across]
    off = axes @ axes.transpose(0, 2, 1)
    goal, step = rng.standard_normal((2, 40, 3))
    limit = goal, off, rng.uniform(0.5, 2, 40)
    x = _within_distance(goal + 2 * rng.standard_normal((40, 3)), limit)
    inward = _inward(x, step, limit)
    for length in (1e-3, 1e-4):
        moved = x - length * inward
        assert abs(_within_distance(moved, limit) - moved).max() < 60 * length**2
    same = (inward == step).all(axis=1)
    away = np.einsum("vij,vj->vi", off, x - goal)
    at_limit = np.linalg.norm(away, axis=1) > 0.999 * limit[2]
    outwards = np.einsum("vi,vi->v", away, -step) > 0
    assert (same == ~(at_limit & outwards)).all() and 0 < same.sum() < 40


@pytest.mark.parametrize("size", [1e-3, 5e-3, 1.0])
def test_small_curves_permit_a_share_of_their_size(near, size):
    line = replace(near.matching.routes[0].crease, points=np.array([[0.0, 0, 0], [size, 0, 0]]))
    line = replace(line, arc=np.array([0, size]), inside=np.ones(1), whole=None)
    routes = [replace(r, crease=replace(r.crease, whole=line)) for r in near.matching.routes]
    small = replace(near, matching=replace(near.matching, routes=tuple(routes)))
    none_yet = np.zeros(len(near.moves))
    found = _permitted_distance(small, none_yet, 0.0015)
    on = np.concatenate([route.vertices for route in routes])
    allowed = INSIDE * near.matching.allowed[on]
    expected = np.minimum(0.0015, allowed * min(1, 0.2 * size / 0.003))
    assert found[on] == pytest.approx(expected)
    assert (np.delete(found, on) == 0.0015).all()
    assert (_permitted_distance(small, none_yet + 0.01, 0.0015) == 0.01).all()
