"""Placing polycubes of any grid on voxels and on parts."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycube.geometry.lattice import boundary, collapse, lattice
from polycube.geometry.rough_map import evaluate
from polycube.plugins.structure.boxes import cumulative, fit_knots
from polycube.registry import build
from polycube.types import TriMesh
from tests.polycubes import PRIMITIVES

L = ("cube", "cube", "cube", None)
T = ("cube", None, "cube", "cube", "cube", None)
U = ("cube", "cube", "cube", None, "cube", "cube")
CORNER = ("cube", "cube", "cube", None, "cube", None, None, None)
HOLED_L = ("hole_z", "cube", "cube", None)
CASES = [((2, 2, 1), L), ((3, 2, 1), T), ((3, 2, 1), U), ((2, 2, 2), CORNER), ((2, 2, 1), HOLED_L)]


def voxels(slabs: np.ndarray, knots: list[np.ndarray]) -> np.ndarray:
    for axis, at in enumerate(knots):
        slabs = slabs.repeat(np.diff(at), axis=axis)
    return slabs


def test_cumulative_counts_below_each_point():
    solid = np.random.default_rng(0).random((3, 4, 5)) < 0.5
    counts = cumulative(solid)
    for i, j, k in np.ndindex(counts.shape):
        assert counts[i, j, k] == solid[:i, :j, :k].sum()


@pytest.mark.parametrize(("grid", "context"), CASES)
def test_knots_are_found_where_they_are(grid, context):
    slabs = collapse(lattice(grid, context, PRIMITIVES)).occupancy
    rng = np.random.default_rng(0)
    for _ in range(3):
        true = [
            np.append(0, np.cumsum(1 + rng.multinomial(m - n, rng.dirichlet(np.full(n, 4.0)))))
            for n, m in zip(slabs.shape, (30, 24, 20), strict=True)
        ]
        knots, misfit = fit_knots(slabs, cumulative(voxels(slabs, true)))
        assert misfit == 0
        for found, wanted in zip(knots, true, strict=True):
            np.testing.assert_array_equal(found, wanted)


@pytest.mark.parametrize("seed", range(4))
def test_no_other_knots_fit_better(seed):
    """Slowly: all knots of an L on voxels with noise."""
    slabs = collapse(lattice((2, 2, 1), L, PRIMITIVES)).occupancy
    rng = np.random.default_rng(seed)
    true = [np.array([0, rng.integers(1, 7), 7]), np.array([0, rng.integers(1, 6), 6]), [0, 3]]
    solid = voxels(slabs, true) ^ (rng.random((7, 6, 3)) < 0.15)
    knots, misfit = fit_knots(slabs, cumulative(solid))
    assert misfit == (voxels(slabs, knots) != solid).sum()
    least = min(
        (voxels(slabs, [[0, x, 7], [0, y, 6], [0, 3]]) != solid).sum()
        for x, y in itertools.product(range(1, 7), range(1, 6))
    )
    assert misfit == least


@pytest.mark.parametrize(("grid", "context"), CASES)
def test_given_places_corners_on_the_part(grid, context):
    """An uneven, turned part: every corner of the polycube lies within a voxel of its own."""
    polycube = collapse(lattice(grid, context, PRIMITIVES))
    outside = boundary(lattice(grid, context, PRIMITIVES))
    uneven = 10 * outside.vertices + 3 * outside.vertices**2  # cells grow from 13 to 19, 25
    rotation = Rotation.random(random_state=3).as_matrix()
    triangles = outside.quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    surface = TriMesh(uneven @ rotation.T, triangles)
    config = {"plugin": "given", "context": list(context)}
    found = build("structure", config, grid=grid, primitives=PRIMITIVES)(surface, ())
    assert found[0].cost < 0.05 and found[0].proposal == "given"
    corners = boundary(polycube).vertices
    true = (10 * corners + 3 * corners**2) @ rotation.T
    gap = np.linalg.norm(evaluate(found[0].rough_map, corners)[:, None] - true, axis=2)
    voxel = np.ptp(uneven, axis=0).max() / 96
    assert max(gap.min(axis=0).max(), gap.min(axis=1).max()) < 3**0.5 * voxel
    ends = evaluate(found[0].rough_map, np.concatenate([np.zeros((1, 3)), np.eye(3)]))
    assert np.linalg.det(ends[1:] - ends[0]) > 0
