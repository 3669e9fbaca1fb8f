"""Harmonic displacements of the vertices of a mesh."""

import numpy as np
import pytest

from polycube.hexmesh.connectivity import boundary_quads, edges
from polycube.numerics.harmonic import harmonic
from tests.fixtures.hexmeshes import unit_cubes


def test_linear_fields_are_reproduced_and_the_boundary_is_exact():
    x, hexes = unit_cubes(4, 3, 5)
    outer = np.unique(boundary_quads(hexes))
    linear = x @ np.array([[0.1, 0.2, 0], [0, 0.3, 0.1], [0.2, 0, 0.1]]) + 0.5
    free = np.setdiff1d(np.arange(len(x)), outer)
    shift = linear.copy()
    shift[free] = 7
    found = harmonic(x, edges(hexes), free, shift)
    assert found == pytest.approx(linear, abs=2e-3)
    assert np.array_equal(found[outer], linear[outer])


def test_a_short_edge_conducts_more():
    """On a line of two edges, the middle is the mean of its ends, weighted by inverse lengths."""
    x = np.array([[0.0, 0, 0], [1, 0, 0], [4, 0, 0]])
    found = harmonic(x, np.array([[0, 1], [1, 2]]), np.array([1]), np.array([[0.0], [9], [8]]))
    assert found[1, 0] == pytest.approx(2)
