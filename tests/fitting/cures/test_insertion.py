"""A new fit in the whole mesh: the local tests agree with those of the whole mesh."""

import numpy as np
import pytest

from polycube.fitting.cures import losses
from polycube.fitting.cures.envelope import evaluated
from polycube.fitting.cures.fitted import fitted
from polycube.fitting.cures.insertion import inserted, placed
from polycube.fitting.cures.neighbourhood import neighbourhood
from polycube.hexmesh.crossings import crossings
from polycube.surface.fit_target import target
from tests.fixtures.cures import lattice_on_rod


@pytest.fixture(scope="module")
def rod():
    surface, mesh = lattice_on_rod()
    return fitted(mesh, target(surface))


@pytest.mark.parametrize("shift", [0.0, 0.01, 0.1])
def test_features_and_crossings_are_those_of_the_whole_mesh(rod, shift):
    owner = rod.links.sides[0]
    near = neighbourhood(rod, owner[:1])
    x = near.problem.mesh.vertices.copy()
    x[near.moves] += [0, 0, shift]
    at = placed(rod, near, x)
    whole = inserted(rod, near, evaluated(near, x, 0.4), at)
    samples = losses.samples_of(rod.target)
    away = losses.percentiles(losses.distances(whole.mesh, samples), samples.feature)
    assert at.away == pytest.approx(away, abs=1e-12)
    assert at.lost(rod, False).any() == (shift > 0)
    assert at.crosses(rod, near) == (len(crossings(whole.mesh)) > 0)


def test_only_the_moving_vertices_move(rod):
    near = neighbourhood(rod, np.array([0]))
    x = near.problem.mesh.vertices + 0.01
    moved = (placed(rod, near, x).vertices != rod.mesh.vertices).any(axis=1)
    assert np.array_equal(np.flatnonzero(moved), near.moving)
