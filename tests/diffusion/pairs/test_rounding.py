"""Fillets and chamfers of lattices: round where they should be, and nothing else moves."""

import numpy as np
import pytest

from polycube.diffusion.pairs.any_structure import Tessellation, tessellate
from polycube.diffusion.pairs.lattices import random_lattice
from polycube.diffusion.pairs.rounding import (
    CHAMFER,
    FILLET,
    EdgeRuns,
    Fillets,
    edge_runs,
    largest_radii,
    rounded,
)

KNOTS = (np.array([0, 2, 3, 5.0]), np.array([0, 1, 2, 4.0]), np.array([0, 1, 3.0]))
HOLE = np.ones((3, 3, 2), bool)
HOLE[1, 1] = False
BLIND = np.ones((3, 3, 2), bool)
BLIND[1, 1, 1] = False
BOSS = np.ones((3, 3, 2), bool)
BOSS[:, :, 1] = False
BOSS[1, 1, 1] = True
TUBE_KNOTS = (np.array([0, 1, 2, 3.0]), np.array([0, 1, 2, 3.0]), np.array([0, 1, 3.0]))


def surface(occupancy: np.ndarray) -> tuple[Tessellation, EdgeRuns]:
    return tessellate(occupancy, KNOTS), edge_runs(occupancy, KNOTS)


def round_along_z(edges: EdgeRuns, is_chosen: np.ndarray) -> np.ndarray:
    return np.where((edges.axis == 2) & is_chosen, largest_radii(edges), 0)


def wall(found: Tessellation, axes: tuple[int, ...], knots: tuple[int, ...]) -> np.ndarray:
    """Vertices of the faces on the given knots of the x and y axes."""
    is_there = np.isin(found.axis // 2, axes) & np.isin(found.knot, knots)
    return np.unique(found.faces[is_there])


@pytest.mark.parametrize("occupancy", [HOLE, BLIND, BOSS])
def test_a_square_section_becomes_a_disc(occupancy: np.ndarray) -> None:
    found, edges = surface(occupancy)
    inner = (edges.at[:, 0] > 1) & (edges.at[:, 0] < 4) & (edges.at[:, 1] > 0.5)
    inner &= edges.at[:, 1] < 3
    radius = round_along_z(edges, inner)
    assert (radius > 0).sum() == 4 and radius.max() == 0.5
    x = rounded(found.vertices, Fillets(edges, radius, np.full(len(radius), FILLET)))
    is_wall = wall(found, (0, 1), (1, 2))
    assert np.hypot(*(x[is_wall, :2] - [2.5, 1.5]).T) == pytest.approx(0.5, abs=1e-12)
    assert np.array_equal(x[:, 2], found.vertices[:, 2])
    outside = wall(found, (0, 1), (0, 3))
    assert np.array_equal(x[outside], found.vertices[outside])


def test_chamfers_and_fillets_of_a_block_touch_their_planes() -> None:
    """A convex edge at (5, 4): all of its side points lie on the line, or on the arc."""
    found, edges = surface(np.ones((3, 3, 2), bool))
    corner = (edges.axis == 2) & (edges.at == [5, 4]).all(axis=1)
    is_side = np.isin(found.axis, (0, 2)).repeat(3)
    own = np.unique(found.faces.ravel()[is_side])
    for norm, order in ((CHAMFER, 1), (FILLET, 2)):
        radius = np.where(corner, 0.75, 0.0)
        x = rounded(found.vertices, Fillets(edges, radius, np.full(len(radius), norm)))[own, :2]
        y = np.maximum((x - [4.25, 3.25]) / 0.75, 0)
        near = (found.vertices[own, :2] >= [4.25, 3.25]).all(axis=1)
        assert near.sum() > 10
        assert np.linalg.norm(y[near], order, axis=1) == pytest.approx(1, abs=1e-12)


def test_the_inner_wall_of_a_tube_stays() -> None:
    """What lies inside an edge that is rounded does not move: the hole of a boss."""
    occupancy = np.ones((3, 3, 2), bool)
    occupancy[1, 1] = False
    found = tessellate(occupancy, TUBE_KNOTS)
    edges = edge_runs(occupancy, TUBE_KNOTS)
    radius = round_along_z(edges, edges.is_convex)
    assert radius.max() == 1.5
    x = rounded(found.vertices, Fillets(edges, radius, np.full(len(radius), FILLET)))
    hole, outside = wall(found, (0, 1), (1, 2)), wall(found, (0, 1), (0, 3))
    assert np.array_equal(x[hole], found.vertices[hole])
    assert np.hypot(*(x[outside, :2] - 1.5).T) == pytest.approx(1.5, abs=1e-12)


def test_three_fillets_round_a_corner() -> None:
    """One after the other: in the ball, and less than 15 per cent of the radius below it."""
    occupancy, ends = np.ones((1, 1, 1), bool), np.array([0, 1.0])
    found = tessellate(occupancy, (ends, ends, ends))
    edges = edge_runs(occupancy, (ends, ends, ends))
    x = rounded(found.vertices, Fillets(edges, np.full(12, 0.5), np.full(12, FILLET)))
    distance = 2 * np.linalg.norm(x - 0.5, axis=1)
    assert distance.max() < 1 + 1e-12 and distance.min() > 0.85
    corner = (found.vertices % 1 == 0).all(axis=1)
    assert distance[corner] == pytest.approx(1, abs=2e-3)


@pytest.mark.parametrize("seed", range(20))
def test_edges_are_between_boxes_of_which_one_is_odd(seed: int) -> None:
    """All of them, as a slow look at every edge of every box finds them."""
    occupancy = random_lattice(np.random.default_rng(seed)).occupancy
    knots = tuple(np.arange(n + 1.0) for n in occupancy.shape)
    edges = edge_runs(occupancy, knots)
    padded = np.pad(occupancy, 1)
    expected = set()
    for axis in range(3):
        turned = padded.transpose((axis + 1) % 3, (axis + 2) % 3, axis)
        for i, j, k in np.ndindex(*(n - 1 for n in turned.shape)):
            n_full = turned[i : i + 2, j : j + 2, k].sum()
            if n_full in (1, 3):
                expected.add((axis, i, j, k - 1, n_full == 1))
    found = [
        (axis, i, j, k, convex)
        for axis, (i, j), (first, last), convex in zip(
            edges.axis, edges.line, edges.span, edges.is_convex, strict=True
        )
        for k in range(first, last)
    ]
    assert len(found) == len(set(found)) and set(found) == expected
    assert (edges.side > 0).all() and (edges.depth > 0).all() and (edges.beyond > 0).all()
