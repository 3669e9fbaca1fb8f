"""Smoothing takes noise away and nothing else."""

import numpy as np
import pytest

from polycube.structure.lattice import boundary
from polycube.structure.smoothing import mean_of, neighbours, pairs_that, taubin
from polycube.types import Polycube


def block(n: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and quads of a unit cube, n squares along an edge."""
    knots = np.linspace(0, 1, n + 1)
    surface = boundary(Polycube(np.ones((n,) * 3, bool), knots, knots, knots, (1, 1, 1), ("cube",)))
    return surface.vertices, surface.quads


def volume(points: np.ndarray, quads: np.ndarray) -> float:
    a, b, c, d = points[quads].transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", (a + b + c + d) / 4, np.cross(c - a, d - b)) / 6)


def test_neighbours_are_the_nearest_of_either() -> None:
    """A slow version: every distance."""
    points = np.random.default_rng(0).random((60, 3))
    distance = np.linalg.norm(points[:, None] - points, axis=2)
    rank = distance.argsort(axis=1).argsort(axis=1)
    near = (rank >= 1) & (rank <= 5)
    np.testing.assert_array_equal(neighbours(points, 5).toarray(), near | near.T)


def test_mean_of_neighbours_leaves_constants_and_pairs_can_be_dropped() -> None:
    points = np.random.default_rng(0).random((60, 3))
    graph = neighbours(points, 5)
    np.testing.assert_allclose(mean_of(graph) @ np.ones(60), 1)
    half = np.arange(60) < 30
    kept = pairs_that(graph, lambda a, b: half[a] == half[b]).toarray()
    assert not kept[:30, 30:].any() and kept[:30, :30].any()
    np.testing.assert_array_equal(kept[:30, :30], graph.toarray()[:30, :30])


@pytest.mark.parametrize("sigma", [0.01, 0.03, 0.05])
def test_noise_goes_and_the_volume_stays_within_one_per_cent(sigma: float) -> None:
    exact, quads = block()
    noisy = exact + np.random.default_rng(0).normal(0, sigma, exact.shape)
    smooth = taubin(noisy, neighbours(exact, 8), 3 * sigma**2, 60)
    before, after = (((p - exact) ** 2).sum(1).mean() for p in (noisy, smooth))
    assert after < 0.6 * before
    assert volume(exact, quads) == pytest.approx(1)
    assert volume(smooth, quads) == pytest.approx(1, rel=0.01)


def test_plain_averaging_would_lose_volume() -> None:
    exact, quads = block()
    mean, shrunk = mean_of(neighbours(exact, 8)), exact
    for _ in range(10):
        shrunk = (shrunk + mean @ shrunk) / 2
    assert volume(shrunk, quads) < 0.97


def test_points_without_noise_or_without_neighbours_stay() -> None:
    exact, _ = block(4)
    np.testing.assert_array_equal(taubin(exact, neighbours(exact, 8), 0.0, 60), exact)
    alone = pairs_that(neighbours(exact, 8), lambda a, b: np.minimum(a, b) > 0)
    moved = taubin(exact, alone, 1.0, 5)
    np.testing.assert_array_equal(moved[0], exact[0])
    assert (moved[1:] != exact[1:]).any()
