"""Noisy points on a polycube become regular."""

import logging

import numpy as np
import pytest

from polycube.registry import build
from polycube.structure.lattice import lattice
from polycube.structure.rough_map import identity_map
from polycube.types import Candidate
from tests.fixtures.polycubes import PRIMITIVES, TWO, on_boundary


@pytest.fixture
def candidate() -> Candidate:
    """Two cells, the second with a hole along z."""
    order = ("cube", "hole_z")
    primitives = {name: build("primitive", {"plugin": name})() for name in order}
    polycube = lattice((2, 1, 1), order, primitives)
    return Candidate("test", polycube, identity_map(polycube), 0.0, "key")


def test_points_move_to_the_nearest_boundary(
    candidate: Candidate, caplog: pytest.LogCaptureFixture
) -> None:
    points = np.array([[0.5, 0.5, 1.2], [0.1, 0.5, 0.5], [1.5, 0.4, 0.5], [2.3, -0.4, 0.5]])
    with caplog.at_level(logging.INFO):
        regular = build("regularize", {"plugin": "project"})(candidate, points)
    expected = [[0.5, 0.5, 1], [0, 0.5, 0.5], [1.5, 1 / 3, 0.5], [2, 0, 0.5]]
    assert regular == pytest.approx(np.array(expected))
    assert "4 points moved 0.217 cells on average, 0.500 at most" in caplog.text


def test_points_on_the_boundary_stay(candidate: Candidate) -> None:
    points = np.array([[0, 0.2, 0.7], [1.4, 1 / 3, 0.9], [2, 1, 1]])
    regular = build("regularize", {"plugin": "project"})(candidate, points)
    assert regular == pytest.approx(points, abs=1e-15)


def bent(points: np.ndarray) -> np.ndarray:
    """Points of the polycube on a part: tapered, bulging and bent."""
    x, y, z = points.T
    return np.stack([x, (y - 0.5) * (1.3 - 0.3 * x) + 0.2 * x**2, 0.7 * z + 0.1 * y**2], axis=1)


def noisy(
    context: tuple[str | None, str | None], sigma: float
) -> tuple[Candidate, np.ndarray, np.ndarray]:
    """A candidate that went from a part to noisy points; those, and where they belong."""
    rng = np.random.default_rng(0)
    polycube = lattice(TWO, context, PRIMITIVES)
    exact = on_boundary(polycube, 1024, rng)
    points = exact + rng.normal(0, sigma, exact.shape)
    states = np.stack([bent(exact), points])
    return Candidate("test", polycube, identity_map(polycube), 0.0, "key", states), points, exact


CONTEXTS = [("cube", "hole_z"), ("hole_x", "hole_x"), ("cube", None), ("hole_y", "hole_z")]


@pytest.mark.parametrize("context", CONTEXTS, ids=str)
def test_smooth_leaves_exact_points_where_they_are(context: tuple) -> None:
    candidate, points, exact = noisy(context, 0.0)
    regular = build("regularize", {"plugin": "smooth"})(candidate, points)
    assert regular == pytest.approx(exact, abs=1e-12)


@pytest.mark.parametrize(("sigma", "share"), [(0.02, 1.0), (0.05, 0.85), (0.1, 0.7), (0.15, 0.65)])
def test_smooth_is_nearer_to_the_truth_than_project(sigma: float, share: float) -> None:
    """Mean distance to the truth, and the share of points on a face of the right direction."""
    error, right = {}, {}
    for name in ("project", "smooth"):
        plugin, off, hits = build("regularize", {"plugin": name}), [], []
        for candidate, points, exact in (noisy(context, sigma) for context in CONTEXTS):
            regular = plugin(candidate, points)
            off.append(np.linalg.norm(regular - exact, axis=1).mean())
            hits.append((np.abs(regular - exact) < 1e-9).any(axis=1).mean())  # in its plane
        error[name], right[name] = np.mean(off), np.mean(hits)
    assert error["smooth"] < share * error["project"]
    assert right["smooth"] > right["project"] - 0.01


def test_smooth_makes_little_of_an_error_that_neighbours_share() -> None:
    candidate, _, exact = noisy(("cube", "hole_z"), 0.0)
    error = {}
    for name in ("project", "smooth"):
        shifted = exact + np.array([0.03, -0.02, 0.04])
        regular = build("regularize", {"plugin": name})(candidate, shifted)
        error[name] = np.linalg.norm(regular - exact, axis=1).mean()
    assert error["smooth"] == pytest.approx(error["project"], rel=0.05)


def test_smooth_without_a_trajectory_is_project(candidate: Candidate) -> None:
    points = np.random.default_rng(0).random((50, 3))
    one, other = (
        build("regularize", {"plugin": name})(candidate, points) for name in ("project", "smooth")
    )
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("options", [{"neighbours": 0}, {"passes": -1}])
def test_smooth_refuses_senseless_numbers(options: dict[str, int]) -> None:
    with pytest.raises(ValueError, match="smooth needs neighbours >= 1 and passes >= 0"):
        build("regularize", {"plugin": "smooth", **options})
