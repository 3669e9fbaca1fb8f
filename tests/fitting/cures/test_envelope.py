"""A neighbourhood with its boundary in an envelope of the surface."""

import numpy as np
import pytest

from polycube.fitting.cures.envelope import envelopes, loosened
from polycube.fitting.cures.fitted import fitted
from polycube.fitting.cures.neighbourhood import neighbourhood
from polycube.fitting.cures.refit import judged
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
    whole = fitted(mesh, target(surface))
    return neighbourhood(whole, np.flatnonzero(whole.jacobian < whole.jacobian.min() + 0.05)[:1])


@pytest.fixture(scope="module")
def found(near):
    return {width: loosened(near, AIM, width, 0.0) for width in WIDTHS}


def away(near, x):
    at = goals_of(near.problem, x, near.matching, np.ones(len(x)))
    return np.linalg.norm(at.place(near.problem, x) - x, axis=1)


@pytest.mark.parametrize("width", WIDTHS)
def test_the_boundary_is_in_the_envelope(near, found, width):
    start = near.problem.mesh.vertices
    allowed = np.maximum(width, away(near, start))
    assert (away(near, found[width].x) <= allowed + 1e-6).all()
    assert found[width].strayed.max() < 1e-12


@pytest.mark.parametrize("width", WIDTHS)
def test_what_is_round_it_stays(near, found, width):
    start = near.problem.mesh.vertices
    assert np.array_equal(found[width].x[~near.moves], start[~near.moves])


def test_poor_hexes_cost_less(near, found):
    start = near.problem.mesh.vertices
    costs = [judged(near, start, AIM).cost, *(found[width].cost for width in WIDTHS)]
    assert costs[1] < 0.6 * costs[0]
    assert max(costs[2:]) < costs[1]


def test_a_hold_keeps_it_nearer(near, found):
    start = near.problem.mesh.vertices
    held = loosened(near, AIM, 0.0015, 10.0)
    outer = near.problem.outer
    far = [np.linalg.norm((each.x - start)[outer], axis=1).max() for each in (held, found[0.0015])]
    assert far[0] < far[1]


def test_a_neighbourhood_without_boundary_is_raised():
    vertices, hexes = unit_cubes(13, 13, 13)
    middle = np.flatnonzero((vertices == 6).all(axis=1))
    vertices[middle] += 0.3
    whole = fitted(hex_mesh(vertices, hexes), target(box(high=(13, 13, 13))))
    inner = neighbourhood(whole, np.flatnonzero((hexes == middle).any(axis=1))[:1])
    assert not len(inner.problem.outer)
    before = judged(inner, inner.problem.mesh.vertices, AIM)
    assert 0 < before.least < AIM <= loosened(inner, AIM, 0.0005, 0.0).least


def test_the_most_exact_is_tried_first():
    assert envelopes(0.0) == [(0.0, 0.0)]
    widths = [width for width, _ in envelopes(0.0015)]
    assert widths == sorted(widths)
    assert widths[0] == 0
    assert max(widths) == 0.0015
