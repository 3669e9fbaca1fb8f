"""Baselines without a network, and confidence intervals of the means."""

import numpy as np
import pytest

from polycube.diffusion.training.evaluation import baselines, summary
from polycube.structure.lattice import OUTWARD, boundary, lattice
from tests.fixtures.polycubes import PRIMITIVES, TWO


def test_baselines_of_a_block_in_another_box() -> None:
    """A scaled and moved box is exact; the normal tells the face where two are equally near."""
    surface = boundary(lattice(TWO, ("cube", "cube"), PRIMITIVES))
    middle = surface.vertices[surface.quads].mean(axis=1)
    normals = OUTWARD[surface.axis]
    corners = np.array([[0.0, 0, 0], [2, 1, 1]])
    true = np.vstack([middle, corners])
    looks = np.vstack([normals, [[0, 0, -1.0], [0, 1.0, 0]]])
    found = baselines(surface, true * [2.0, 3, 0.5] + 1, looks)
    assert set(found) == {"untouched", "box", "normals", "centre"}
    assert np.allclose(found["box"][0], true) and np.allclose(found["normals"][0], true)
    assert np.allclose(found["untouched"][0], true * [2.0, 3, 0.5] + 1)
    assert np.allclose(found["centre"][0], [1, 0.5, 0.5])
    faces = found["normals"][1]
    assert np.array_equal(surface.axis[faces[:-2]], surface.axis)
    assert np.array_equal(OUTWARD[surface.axis[faces[-2:]]], looks[-2:])


def test_the_interval_of_a_mean_contains_it_in_95_of_100_cases() -> None:
    rng = np.random.default_rng(0)
    inside = []
    for _ in range(400):
        columns = [{"error": rng.normal(3 + rng.normal(), 1, 50)} for _ in range(60)]
        found = summary(columns)
        inside.append(abs(found["error"] - 3) < found["error_interval"])
    assert np.mean(inside) == pytest.approx(0.95, abs=0.035)
    assert "error_interval" not in summary([{"error": np.ones(4)}])
