"""Fast winding numbers against the sum over all faces."""

import numpy as np

from polycube.examples.parts import example
from polycube.surface.measures import winding_numbers
from polycube.surface.winding import fast_winding_numbers
from polycube.types import TriMesh


def test_equal_to_the_slow_sum_inside_outside_and_through_a_hole():
    whole = example("rod")
    for surface in (whole, TriMesh(whole.vertices, whole.faces[len(whole.faces) // 20 :])):
        low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
        points = low + np.random.default_rng(0).random((300, 3)) * (high - low)
        slow = winding_numbers(surface, points)
        assert np.ptp(slow) > 0.9
        np.testing.assert_allclose(fast_winding_numbers(surface, points), slow, atol=0.05)
