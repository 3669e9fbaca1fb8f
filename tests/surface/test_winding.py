"""Fast winding numbers against the sum over all faces."""

import numpy as np
import pytest

from polycube.examples.parts import example
from polycube.surface.measures import diagonal
from polycube.surface.voxels import winding_numbers
from polycube.types import TriMesh
from tests.fixtures.surfaces import box


def summed(surface: TriMesh, points: np.ndarray) -> np.ndarray:
    """(N,) how often the surface winds around each of (N, 3) points: 1 inside, 0 outside."""
    return np.array([_solid_angle(surface, point) / (4 * np.pi) for point in points])


def _solid_angle(surface: TriMesh, point: np.ndarray) -> float:
    """Of all faces as seen from the point; tan(angle / 2) of each by van Oosterom and Strackee."""
    rays = surface.vertices[surface.faces] - point  # (F, 3, 3)
    a, b, c = np.moveaxis(rays / diagonal(surface), 1, 0)
    la, lb, lc = (np.linalg.norm(r, axis=1) for r in (a, b, c))
    ab, bc, ca = (np.einsum("fi,fi->f", *pair) for pair in ((a, b), (b, c), (c, a)))
    above = np.einsum("fi,fi->f", a, np.cross(b, c))
    return float(2 * np.arctan2(above, la * lb * lc + ab * lc + bc * la + ca * lb).sum())


def test_equal_to_the_slow_sum_inside_outside_and_through_a_hole():
    closed = example("rod")
    for surface in (closed, TriMesh(closed.vertices, closed.faces[len(closed.faces) // 20 :])):
        low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
        points = low + np.random.default_rng(0).random((300, 3)) * (high - low)
        slow = summed(surface, points)
        assert np.ptp(slow) > 0.9
        np.testing.assert_allclose(winding_numbers(surface, points), slow, atol=0.01)


def test_winding_number_counts_turns():
    points = np.array([[0.3, 0.6, 0.5], [1.5, 0.5, 0.5]])  # inside, outside
    assert winding_numbers(box(), points) == pytest.approx([1, 0], abs=0.01)
    assert summed(box(), points) == pytest.approx([1, 0])
