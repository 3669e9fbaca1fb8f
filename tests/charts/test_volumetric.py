import numpy as np
import pytest

from polycube.charts.charts import flatten
from polycube.charts.harmonic import chart_map, lattice_weights
from polycube.charts.segmentation import segment
from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.generation.template import mesh
from polycube.hexmesh.quality import deviation
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.structure.rough_map import affine_map, evaluate
from polycube.surface.closest import distance
from polycube.surface.fit_target import target
from polycube.types import Parametrization
from tests.fixtures.charts import TURNED, given, ring
from tests.fixtures.hexmeshes import CORNERS


@pytest.mark.parametrize("context", [("cube", "cube"), ("hole_y", "hole_x"), ("cube", "hole_z")])
def test_a_sheared_polycube_gets_its_own_shear(context):
    """Exact on the boundary and, linear maps being harmonic, inside."""
    surface, polycube, labels, places = given(context)
    pieces = segment(surface, polycube, labels, Parametrization(places), 0.1)
    parts = tuple(np.arange(n) % 3 + 2 for n in polycube.occupancy.shape)
    rough = affine_map(polycube, TURNED @ np.diag([1.0, 1.3, 0.8]), np.ones(3))
    found = chart_map(polycube, pieces.outside, flatten(pieces), rough, parts)
    wanted = affine_map(polycube, TURNED, np.zeros(3))
    np.testing.assert_allclose(
        mesh(polycube, found, parts).vertices, mesh(polycube, wanted, parts).vertices, atol=1e-8
    )


def test_a_ring_has_its_boundary_on_the_surface_and_the_given_map_in_the_hole():
    surface, polycube, labels, places = ring()
    pieces = segment(surface, polycube, labels, places, 0.05)
    rough = affine_map(polycube, np.diag([5.0, 5.0, 1.0]), np.array([-2.5, -2.5, -0.5]))
    parts = tuple(np.full(n, 4) for n in polycube.occupancy.shape)
    found = chart_map(polycube, pieces.outside, flatten(pieces), rough, parts)
    hexes = mesh(polycube, found, parts)
    assert deviation(hexes, surface).vertices < 1e-12
    jacobian = scaled_jacobian(hexes.vertices, hexes.hexes)
    assert (jacobian > 0).mean() > 0.98  # before any descent
    hole = np.array([[0.5, 0.5, 0.5]])
    np.testing.assert_allclose(evaluate(found, hole), evaluate(rough, hole), atol=1e-12)
    middle = target(surface).to_unit(hexes.vertices[hexes.quads].mean(axis=1))
    assert np.median(distance(target(surface).tree, middle)) < 0.01


def test_linear_functions_are_harmonic_on_an_uneven_lattice():
    lines = [np.array(line) for line in ([0, 1, 3.0], [0, 0.2, 1.2, 1.5], [0, 2, 2.5, 7])]
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    index = np.arange(len(points)).reshape([len(line) for line in lines])
    low = np.argwhere(np.ones(np.array(index.shape) - 1, bool))
    hexes = index[tuple((low[:, None] + CORNERS).transpose(2, 0, 1))]
    weights = lattice_weights(points, hexes)
    assert abs(weights - weights.T).max() < 1e-12
    pull = weights @ points - np.asarray(weights.sum(axis=1)) * points
    inner = ~np.isin(np.arange(len(points)), hex_mesh(points, hexes).quads)
    assert inner.sum() == 4
    np.testing.assert_allclose(pull[inner], 0, atol=1e-12)
