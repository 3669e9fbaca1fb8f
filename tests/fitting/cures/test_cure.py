"""Cures of a complete mesh: the gain, and the features and labels that must not be lost."""

from functools import cache

import numpy as np
import pytest

from polycube.fitting.cures.cure import _Cures, cure
from polycube.fitting.cures.fitted import fitted, hex_costs
from polycube.fitting.cures.neighbourhood import neighbourhood
from polycube.hexmesh import connectivity
from polycube.hexmesh.crossings import crossings
from polycube.hexmesh.inspection import inspect
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.registry import build
from polycube.surface.fit_target import target
from tests.conftest import first_quick
from tests.fixtures.cures import lattice_on_rod


def least(mesh):
    return scaled_jacobian(mesh.vertices, mesh.hexes).min()


@cache
def cured_lattice(across):
    surface, mesh = lattice_on_rod(across)
    return surface, mesh, cure(mesh, target(surface), 0.4, 0.0)


@pytest.fixture(scope="module", params=first_quick(1, [5, 6]))  # with sheets from 6 on
def case(request):
    """The rod, and its mesh before and after the cure."""
    return cured_lattice(request.param)


@pytest.mark.slow
def test_a_lattice_on_a_rod_gets_rings_at_its_ends():
    _, mesh, cured = cured_lattice(6)
    assert least(mesh) < 0.25
    assert least(cured) > 0.4
    assert len(cured.hexes) > len(mesh.hexes)


def test_the_mesh_is_conforming_and_keeps_its_labels(case):
    _, mesh, cured = case
    connectivity.check_conforming(cured)
    assert set(cured.patch) == set(mesh.patch)
    assert set(cured.cell) == set(mesh.cell)
    assert cured.primitives == mesh.primitives


@pytest.mark.slow
def test_no_feature_is_lost_and_the_boundary_does_not_cross_itself():
    surface, _, cured = cured_lattice(6)
    assert max(each.distance for each in inspect(cured, surface).features) < 0.003
    assert not len(crossings(cured))


def test_paths_lie_on_their_curves(case):
    surface, _, cured = case
    goal = target(surface)
    assert set(cured.paths) == {"0", "1"}
    for number, path in cured.paths.items():
        _, off = goal.followed.creases[int(number)].nearest(goal.to_unit(cured.vertices[path]))
        assert off.max() < 1e-6


def test_a_good_mesh_is_returned_unchanged(case):
    surface, _, cured = case
    assert cure(cured, target(surface), 0.3, 0.0015) is cured


@pytest.mark.slow
@pytest.mark.parametrize("more", [0.1, 0.02])
def test_further_hexes_are_improved_without_sheets(more):
    surface, _, cured = cured_lattice(6)
    found = cure(cured, target(surface), 0.3, 0.0015, least(cured) + more)
    assert least(found) > least(cured) + 0.1 * more
    assert np.array_equal(found.hexes, cured.hexes)
    assert not any(each.is_lost for each in inspect(found, surface).features)


class Bounded(_Cures):
    """Cures that lose all features if a vertex moves farther than `most`."""

    most = 1.0

    def _lost(self, trial):
        way = np.linalg.norm(trial.found.x - trial.near.problem.mesh.vertices, axis=1).max()
        return np.full(self.current.away.shape[1], way > self.most)


@pytest.mark.parametrize("is_last", [True, False])
def test_a_fit_that_loses_features_is_accepted_in_part_at_last(is_last):
    surface, mesh = lattice_on_rod()
    cures = Bounded(fitted(mesh, target(surface)), 0.4, 0.0015)
    cures._is_last = is_last
    near = neighbourhood(cures.current, np.array([cures.current.jacobian.argmin()]))
    whole = cures._envelope(near)
    move = whole.found.x - near.problem.mesh.vertices
    cures.most = 0.6 * np.linalg.norm(move, axis=1).max()
    part = cures._envelope(near)
    if is_last:
        expected = 0.5 * move
        np.testing.assert_allclose(part.found.x - near.problem.mesh.vertices, expected, atol=1e-12)
        assert whole.before > part.found.cost > whole.found.cost
    else:
        assert part is None


class Failing(_Cures):
    """Cures without success, and their number."""

    calls = 0

    def _envelope(self, near):
        self.calls += 1


def test_a_fit_that_failed_is_repeated_only_with_another_aim():
    surface, mesh = lattice_on_rod()
    cures = Failing(fitted(mesh, target(surface)), 0.4, 0.0015)
    cures.run(None)
    first = cures.calls
    cures.run(None)
    assert cures.calls == first > 0
    cures._aim = 0.45
    cures.run(None)
    assert cures.calls > first


@pytest.mark.slow
@pytest.mark.parametrize("width", [0.0, 0.0015])
def test_without_sheets_the_boundary_stays_in_the_envelope(width):
    surface, mesh = lattice_on_rod()
    goal = target(surface)
    found = cure(mesh, goal, 0.4, width)
    before, after = (
        hex_costs(scaled_jacobian(each.vertices, each.hexes), 0.4).sum() for each in (mesh, found)
    )
    assert after < 0.95 * before
    place = goal.to_unit(found.vertices[np.unique(found.quads)])
    off = np.linalg.norm(goal.closest(place)[0] - place, axis=1).max()
    assert off < width + 1e-6
    assert not any(each.is_lost for each in inspect(found, surface).features)


@pytest.mark.slow
def test_the_same_input_gives_the_same_mesh():
    surface, mesh, cured = cured_lattice(6)
    again = cure(mesh, target(surface), 0.4, 0.0)
    assert np.array_equal(again.vertices, cured.vertices)


@pytest.mark.slow
def test_the_stage_cures_exact_features_only():
    surface, mesh = lattice_on_rod()
    assert least(build("meshing/cure", {"plugin": "sheets"})(surface, mesh)) > 0.35
    soft = build("meshing/cure", {"plugin": "sheets", "features": "soft"})
    assert soft(surface, mesh) is mesh
    none = build("meshing/cure", {"plugin": "sheets", "aim": 0})
    assert none(surface, mesh) is mesh


def test_a_mesh_that_crosses_itself_in_many_places_is_not_cured(monkeypatch):
    surface, mesh = lattice_on_rod()
    monkeypatch.setattr("polycube.hexmesh.crossings.MOST_CROSSINGS", 0)
    assert build("meshing/cure", {"plugin": "sheets"})(surface, mesh) is mesh


@pytest.mark.parametrize(
    ("option", "message"), [({"aim": 2}, "aim must be"), ({"envelope": 0.01}, "envelope must be")]
)
def test_invalid_options_are_refused(option, message):
    with pytest.raises(ValueError, match=message):
        build("meshing/cure", {"plugin": "sheets", **option})
