"""Elements of different levels are connected without cracks."""

import logging
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.spline.spaces.hierarchy import hierarchical_spline, remainder, ring
from tests.fixtures.hierarchies import (
    MESHES,
    SPACES,
    at_the_finest,
    levels_of,
    random_levels,
    space_of,
)


def crack(mesh, levels, spline):
    """Largest jump between elements of three random functions, coefficients in [0, 1]."""
    values = spline.extraction @ np.random.default_rng(1).random((spline.extraction.shape[1], 3))
    nodes, found = at_the_finest(mesh, levels, spline, values)
    worst = 0.0
    for column in found.reshape(-1, 3).T:
        low, high = np.full(nodes.max() + 1, np.inf), np.full(nodes.max() + 1, -np.inf)
        np.minimum.at(low, nodes.ravel(), column)
        np.maximum.at(high, nodes.ravel(), column)
        worst = max(worst, (high - low).max())
    return worst


@pytest.mark.parametrize("plugin", SPACES)
@pytest.mark.parametrize("name", MESHES)
@settings(max_examples=2, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1))
def test_any_refinement_has_no_crack_and_sums_to_one(name, plugin, seed):
    mesh = MESHES[name]
    levels = random_levels(space_of(mesh, plugin), seed)
    spline = hierarchical_spline(levels)
    assert crack(mesh, levels, spline) < 1e-13
    assert abs(spline.extraction.sum(axis=1) - 1).max() < 1e-14
    assert sum(4.0 ** -spline.level[spline.sides[:, 0]]) == len(mesh.quads)
    assert sum(8.0**-spline.level) == len(mesh.hexes)


def test_straight_hexes_next_to_others_refine_without_a_crack():
    mesh = MESHES["ball"]
    space = replace(space_of(mesh), straight=np.array([0, 3]))
    levels = levels_of(space, ring(space, np.array([0]))[:5], [0, 7, 9])
    spline = hierarchical_spline(levels)
    assert crack(mesh, levels, spline) < 1e-13
    assert abs(spline.extraction.sum(axis=1) - 1).max() < 1e-14


def test_the_crack_test_finds_cracks(caplog):
    """Without the carried remainders, h2s levels have cracks at an extraordinary edge."""
    mesh = MESHES["cylinder"]
    levels = levels_of(space_of(mesh), np.arange(len(mesh.hexes) // 3))
    with caplog.at_level(logging.INFO):
        spline = hierarchical_spline(levels)
        assert "levels are not nested: remainders up to 0.0" in caplog.text
        caplog.clear()
        hierarchical_spline(levels_of(space_of(mesh, "optimal"), [0, 1, 2]))
        assert "not nested" not in caplog.text
    assert crack(mesh, levels, spline) < 1e-14
    coarse, fine = levels
    missed = remainder(coarse, fine)
    assert abs(missed).max() > 0.01
    ends = fine.space.nodes[fine.inside]
    shared = np.intersect1d(ends, fine.space.nodes[~fine.inside])
    assert abs(missed[shared]).max() > 0.01
