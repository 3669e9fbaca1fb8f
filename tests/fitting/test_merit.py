"""The merit by which the fitting stages compare meshes."""

import numpy as np
import pytest

from polycube.fitting.snapping import exceeded_limits, merit, merit_of
from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.inspection import inspect
from tests.fixtures.hexmeshes import unit_cubes
from tests.fixtures.surfaces import box as surface_box

CUBE = surface_box((0, 0, 0), (2, 2, 2))


def test_merit_saturates_and_ignores_small_deviations():
    assert merit_of(0.4, 0.001, 0.003) == 0.4
    assert merit_of(0.8, 0.0, 0.0) == pytest.approx(0.65)
    assert merit_of(0.5, 0.002, 0.0) == pytest.approx(0.48)
    assert merit_of(0.5, 0.0, 0.013) == pytest.approx(0.45)
    assert merit_of(-0.1, 0.0, 0.0) < merit_of(0.01, 0.1, 0.1) - 1e5


def test_an_exact_mesh_exceeds_no_limit():
    found = inspect(hex_mesh(*unit_cubes(2, 2, 2)), CUBE)
    assert exceeded_limits(found) == 0
    assert merit(found) == pytest.approx(0.6 + 0.25 * 0.4)


def test_any_valid_mesh_beats_an_inverted_one():
    vertices, cubes = unit_cubes(2, 2, 2)
    far = hex_mesh(vertices * 3, cubes)
    inner = vertices + np.outer((vertices == 1).all(axis=1), [1.2, 1.2, 1.2])
    inverted = hex_mesh(inner, cubes)  # the boundary fits exactly
    assert merit(inspect(far, CUBE)) > merit(inspect(inverted, CUBE))


@pytest.mark.parametrize(
    ("change", "number"),
    [
        (lambda v: v * [1, 1, 1.05], 2),  # vertices and volume
        (lambda v: v + np.array([0.2, 0, 0]), 2),  # vertices and largest distance
        (lambda v: v + np.outer((v == 1).all(axis=1), [0.95] * 3), 1),  # scaled Jacobian
    ],
)
def test_each_limit_is_counted_separately(change, number):
    vertices, cubes = unit_cubes(2, 2, 2)
    found = inspect(hex_mesh(change(vertices), cubes), CUBE)
    assert exceeded_limits(found) == number and merit(found) < 0.6
