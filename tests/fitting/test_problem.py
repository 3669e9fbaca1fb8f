"""Lengths, scaled Jacobians and closest points of a FitProblem."""

import numpy as np
import pytest
import trimesh

from polycube.fitting.problem import FitProblem
from polycube.hexmesh.connectivity import EDGES, hex_mesh
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.surface.fit_target import target
from polycube.types import TriMesh
from tests.fixtures.hexmeshes import unit_cubes


@pytest.fixture(scope="module")
def problem() -> FitProblem:
    """A block of 20 x 20 x 20 hexes: more than one thread's share."""
    solid = trimesh.creation.box()
    return FitProblem(
        hex_mesh(*unit_cubes(20, 20, 20)), target(TriMesh(solid.vertices, solid.faces)), 10
    )


def test_lengths_of_a_box_are_its_sides(problem):
    x = problem.mesh.vertices * [1.0, 2.0, 3.0]
    assert problem.lengths(x, 0, 0.0) == pytest.approx(np.tile([1.0, 2.0, 3.0], (8000, 1)))
    even = problem.lengths(x, 2, 1.0)
    assert even == pytest.approx(np.full((8000, 3), 6 ** (1 / 3)))


def test_lengths_are_means_of_four_edges(problem):
    x = problem.mesh.vertices + np.random.default_rng(0).uniform(
        -0.3, 0.3, problem.mesh.vertices.shape
    )
    ends = x[problem.hexes[:, EDGES]]
    length = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2)
    assert problem.lengths(x, 0, 0.0) == pytest.approx(length.reshape(-1, 3, 4).mean(axis=2))


def test_scaled_jacobians_in_parts_equal_those_in_one_call(problem):
    x = problem.mesh.vertices + np.random.default_rng(0).uniform(
        -0.3, 0.3, problem.mesh.vertices.shape
    )
    assert np.array_equal(problem.scaled_jacobian(x), scaled_jacobian(x, problem.hexes))


def test_incremental_closest_points_equal_those_of_a_full_query(problem):
    rng = np.random.default_rng(4)
    x = problem.target.to_unit(problem.mesh.vertices - 10) + 0.02 * rng.normal(
        size=problem.mesh.vertices.shape
    )
    for share in (0.0, 0.01, 1.0):
        x = x + 0.02 * rng.normal(size=x.shape) * (rng.random(len(x)) < share)[:, None]
        normals, _ = problem.normals(x)
        for alpha in (0.04, 0.1):
            found = problem.feet(x, normals, alpha, 1.0)
            again = FitProblem(problem.mesh, problem.target, 10).feet(x, normals, alpha, 1.0)
            assert found[0] == pytest.approx(again[0], abs=1e-12)
