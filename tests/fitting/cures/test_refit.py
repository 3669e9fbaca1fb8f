"""The fit of a neighbourhood: moving vertices, goals and cost."""

import numpy as np
import pytest

from polycube.fitting.cures.envelope import refit
from polycube.fitting.cures.fitted import cost, fitted, with_flat_corners
from polycube.fitting.cures.neighbourhood import neighbourhood
from polycube.surface.fit_target import target
from tests.fixtures.cures import lattice_on_rod

AIM = 0.4


@pytest.fixture(scope="module")
def trial():
    surface, mesh = lattice_on_rod()
    fit = fitted(mesh, target(surface))
    _, inside = next(with_flat_corners(fit))
    near = neighbourhood(fit, np.array([0]), inside)
    moving = near.used[near.moves[: len(near.used)]]
    before, _ = cost(fit.jacobian[near.elements], fit.gap[moving], fit.strayed[moving], AIM)
    return near, refit(near, AIM, before), before


def test_a_sheet_under_an_end_of_a_rod_costs_less(trial):
    near, found, before = trial
    assert before > 0.1
    assert found.cost < 0.1 * before
    assert found.least == pytest.approx(near.problem.scaled_jacobian(found.x).min())


def test_vertices_around_the_neighbourhood_are_fixed(trial):
    near, found, _ = trial
    still = ~near.moves
    assert still.any()
    assert np.array_equal(found.x[still], near.problem.mesh.vertices[still])


def test_the_boundary_is_on_the_surface(trial):
    near, found, _ = trial
    problem = near.problem
    outer = problem.outer[near.moves[problem.outer]]
    off = np.linalg.norm(problem.target.closest(found.x[outer])[0] - found.x[outer], axis=1)
    assert off.max() < 1e-3
    assert found.strayed.max() == 0


def test_a_fit_with_a_large_cost_is_abandoned(trial):
    near, found, _ = trial
    assert refit(near, AIM, 0.0).cost >= found.cost
