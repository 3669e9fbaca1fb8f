"""Noisy points on a polycube become regular."""

import logging

import numpy as np
import pytest

from polycube.geometry.lattice import lattice
from polycube.geometry.rough_map import identity_map
from polycube.registry import build
from polycube.types import Candidate


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
