"""Placing polycubes of any grid on voxels and on parts."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycube.plugins.structure.slices.knots import cumulative, fit_knots
from polycube.registry import build
from polycube.structure.lattice import boundary, collapse, lattice
from polycube.structure.rough_map import evaluate
from polycube.surface.frames import rotations, turn
from polycube.types import Candidate, Polycube, TriMesh
from tests.fixtures.polycubes import NAMES, PRIMITIVES

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
def test_knots_are_found_at_their_positions(grid, context):
    slabs = collapse(lattice(grid, context, PRIMITIVES)).occupancy
    rng = np.random.default_rng(0)
    for _ in range(3):
        true = [
            np.append(0, np.cumsum(1 + rng.multinomial(m - n, rng.dirichlet(np.full(n, 4.0)))))
            for n, m in zip(slabs.shape, (30, 24, 20), strict=True)
        ]
        knots, misfit = fit_knots(slabs, cumulative(voxels(slabs, true)), 9)
        assert misfit == 0
        for found, wanted in zip(knots, true, strict=True):
            np.testing.assert_array_equal(found, wanted)


@pytest.mark.parametrize("seed", range(4))
def test_no_other_knots_fit_better(seed):
    """Exhaustive search over all knots of an L on voxels with noise."""
    slabs = collapse(lattice((2, 2, 1), L, PRIMITIVES)).occupancy
    rng = np.random.default_rng(seed)
    true = [np.array([0, rng.integers(1, 7), 7]), np.array([0, rng.integers(1, 6), 6]), [0, 3]]
    solid = voxels(slabs, true) ^ (rng.random((7, 6, 3)) < 0.15)
    knots, misfit = fit_knots(slabs, cumulative(solid), 9)
    assert misfit == (voxels(slabs, knots) != solid).sum()
    least = min(
        (voxels(slabs, [[0, x, 7], [0, y, 6], [0, 3]]) != solid).sum()
        for x, y in itertools.product(range(1, 7), range(1, 6))
    )
    assert misfit == least


def uneven_part(grid: tuple, context: tuple) -> tuple[TriMesh, np.ndarray]:
    """A rotated part with cells of size 13, 19 and 25, and the corners of its polycube on it."""
    rotation = Rotation.random(random_state=3).as_matrix()
    outside = boundary(lattice(grid, context, PRIMITIVES))
    corners = boundary(collapse(lattice(grid, context, PRIMITIVES))).vertices
    triangles = outside.quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    whole, ends = ((10 * v + 3 * v**2) @ rotation.T for v in (outside.vertices, corners))
    return TriMesh(whole, triangles), ends


def corner_gap(candidate: Candidate, corners: np.ndarray) -> float:
    """Largest distance between corners of the part and of the candidate, either way."""
    found = evaluate(candidate.rough_map, boundary(candidate.polycube).vertices)
    gap = np.linalg.norm(found[:, None] - corners, axis=2)
    return max(gap.min(axis=0).max(), gap.min(axis=1).max())


def shapes(polycube: Polycube) -> set:
    """The boxes in all rotations."""
    turned = [turn(collapse(polycube).occupancy, rotation) for rotation in rotations()]
    return {(boxes.shape, boxes.tobytes()) for boxes in turned}


@pytest.mark.parametrize(("grid", "context"), CASES)
def test_given_places_corners_on_the_part(grid, context):
    """Every corner of the polycube is within a voxel of its exact position."""
    surface, corners = uneven_part(grid, context)
    config = {"plugin": "given", "context": list(context)}
    best = build("structure", config, grid=grid, primitives=PRIMITIVES)(surface, ())[0]
    assert best.cost < 0.05 and best.proposal == "given"
    assert corner_gap(best, corners) < 3**0.5 * 44 / 96
    ends = evaluate(best.rough_map, np.concatenate([np.zeros((1, 3)), np.eye(3)]))
    assert np.linalg.det(ends[1:] - ends[0]) > 0


@pytest.mark.parametrize(
    ("grid", "context", "use"),
    [
        ((2, 2, 1), L, NAMES),
        pytest.param((2, 2, 1), HOLED_L, NAMES, marks=pytest.mark.slow),
        ((3, 2, 1), T, ["cube"]),
        ((3, 2, 1), U, ["cube"]),
        ((2, 2, 2), CORNER, ["cube"]),
        ((2, 1, 1), ("cube", "hole_y"), NAMES),
    ],
)
def test_boxes_recognise_the_shape(grid, context, use):
    surface, corners = uneven_part(grid, context)
    primitives = {name: PRIMITIVES[name] for name in use}
    found = build("structure", {"plugin": "boxes"}, grid=grid, primitives=primitives)(surface, ())
    assert shapes(found[0].polycube) == shapes(lattice(grid, context, PRIMITIVES))
    assert found[0].proposal == "boxes" and len(found) <= 6
    assert [c.cost for c in found] == sorted(c.cost for c in found)
    assert corner_gap(found[0], corners) < 3**0.5 * 44 / 96


def test_boxes_propose_nothing_of_another_genus():
    surface, _ = uneven_part((3, 1, 1), ("hole_y",) * 3)
    propose = build("structure", {"plugin": "boxes"}, grid=(2, 1, 1), primitives=PRIMITIVES)
    assert propose(surface, ()) == []
