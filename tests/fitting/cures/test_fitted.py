"""A fitted mesh with its constraints, and the cost of its hexes and features."""

import numpy as np
import pytest

from polycube.fitting.creases.paths import path_sides
from polycube.fitting.cures.fitted import cost, edge_keys, fitted, hex_costs
from polycube.hexmesh.connectivity import quad_edges
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.surface.fit_target import target
from tests.fixtures.cures import lattice_on_rod


@pytest.fixture(scope="module")
def rod():
    surface, mesh = lattice_on_rod()
    return fitted(mesh, target(surface))


def test_cost_is_one_for_a_flat_hex_and_zero_at_the_aim():
    found = hex_costs(np.array([0.0, 0.25, 0.5, 0.9]), 0.5)
    assert found == pytest.approx([1, 0.5**4, 0, 0])


def test_an_inverted_hex_costs_more_than_any_distance():
    none = np.zeros(3)
    good, least = cost(np.array([0.5, 0.6]), none, none, 0.4)
    assert (good, least) == (0, 0.5)
    inverted, _ = cost(np.array([-0.1, 0.6]), none, none, 0.4)
    off, _ = cost(np.array([0.5, 0.6]), none + 0.01, none, 0.4)
    assert inverted > 10 > off > 0


def test_paths_are_boundary_edges(rod):
    n = len(rod.gap)
    edges = edge_keys(quad_edges(rod.mesh.quads)[0], n)
    assert len(rod.on_path) > 40
    assert np.isin(rod.on_path, edges).all()


def test_sides_of_a_loop_close_it():
    path = np.array([4, 2, 7])
    assert path_sides(path, True).tolist() == [[4, 2], [2, 7], [7, 4]]
    assert path_sides(path, False).tolist() == [[4, 2], [2, 7]]


def test_scaled_jacobians_and_cad_faces(rod):
    _, mesh = lattice_on_rod()
    assert rod.jacobian == pytest.approx(scaled_jacobian(mesh.vertices, mesh.hexes), abs=1e-9)
    assert np.unique(rod.cad_face).tolist() == [1, 2, 3]
