"""Features that a mesh loses: the same as in the report, also after updates."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycube.fitting.cures.fitted import fitted
from polycube.fitting.cures.insertion import Placed
from polycube.fitting.cures.losses import (
    CURVE,
    FACE,
    SHARES,
    distances,
    moved,
    percentiles,
    samples_of,
)
from polycube.hexmesh.feature_distances import TOLERANCE
from polycube.hexmesh.inspection import inspect
from polycube.surface.fit_target import target
from tests.fixtures.cures import lattice_on_rod


@pytest.fixture(scope="module")
def rod():
    """Target, samples, and a mesh of it at unit scale."""
    surface, mesh = lattice_on_rod()
    goal = target(surface)
    return goal, samples_of(goal), replace(mesh, vertices=goal.to_unit(mesh.vertices))


def test_a_rod_has_two_rims_and_three_faces(rod):
    _, samples, _ = rod
    first = np.unique(samples.feature, return_index=True)[1]
    assert samples.kind[first].tolist() == [CURVE] * 2 + [FACE] * 3


def lost(distance, samples):
    return set(np.flatnonzero(percentiles(distance, samples.feature)[0] > TOLERANCE).tolist())


def test_a_fitted_mesh_loses_none(rod):
    _, samples, mesh = rod
    assert lost(distances(mesh, samples), samples) == set()


@given(st.lists(st.integers(1, 60), min_size=1, max_size=5), st.integers(0, 99))
def test_percentiles_are_those_of_each_feature(counts, seed):
    feature = np.repeat(np.arange(len(counts)), counts)
    mixed = np.random.default_rng(seed).permutation(len(feature))
    distance = np.random.default_rng(seed).exponential(size=len(feature))
    found = percentiles(distance[mixed], feature[mixed])
    slow = [np.percentile(distance[feature == k], SHARES) for k in range(len(counts))]
    assert found.T == pytest.approx(np.array(slow))


def test_a_cure_in_an_envelope_leaves_fewer_samples_far_than_a_sheet(rod):
    """A rim of which 3 per cent are far is not lost in the report."""
    goal, samples, mesh = rod
    fit = fitted(replace(mesh, vertices=goal.to_model(mesh.vertices)), goal)
    (rim,) = np.nonzero(samples.feature == 0)
    distance = np.zeros(len(samples.feature))
    distance[rim[: len(rim) * 3 // 100]] = 1.0
    assert lost(distance, samples) == set()
    after = replace(fit, distance=distance)
    at = Placed(*[np.zeros(0)] * 2, fit.mesh, distance, after.away)
    assert at.lost(replace(fit, distance=np.zeros_like(distance)), True).tolist() == [1, 0, 0, 0, 0]
    assert not at.lost(replace(fit, distance=np.zeros_like(distance)), False).any()


@pytest.mark.parametrize("factor", [1.0, 1.02, 1.1])
def test_losses_are_those_of_the_report(rod, factor):
    """Rims and ends move out together."""
    goal, samples, mesh = rod
    vertices = mesh.vertices.copy()
    vertices[abs(vertices[:, 2]) > 0.28] *= [1, 1, factor]
    found = lost(distances(replace(mesh, vertices=vertices), samples), samples)
    model = replace(mesh, vertices=goal.to_model(vertices))
    features = inspect(model, lattice_on_rod()[0]).features
    assert found == {k for k, each in enumerate(features) if each.is_lost}
    assert bool(found) == (factor > 1.01)


@pytest.mark.parametrize("seed", range(5))
def test_updated_distances_equal_those_of_the_complete_mesh(rod, seed):
    _, samples, mesh = rod
    rng = np.random.default_rng(seed)
    moves = np.zeros(len(mesh.vertices), bool)
    moves[mesh.hexes[rng.integers(len(mesh.hexes))]] = True
    near = np.unique(mesh.hexes[moves[mesh.hexes].any(axis=1)])
    vertices = mesh.vertices.copy()
    vertices[moves] += rng.uniform(-0.004, 0.004, (moves.sum(), 3))
    new = replace(mesh, vertices=vertices)
    where = np.concatenate([mesh.vertices[near], vertices[near]])
    after = moved(distances(mesh, samples), new, samples, where)
    assert after == pytest.approx(distances(new, samples), abs=1e-12)
