from dataclasses import replace

import numpy as np
import pytest

from polycube.hexmesh.connectivity import hex_mesh
from polycube.io.hex_meshes import boundary
from polycube.spline.bezier import min_detj, scaled_detj
from polycube.spline.boundary import deviation
from polycube.spline.spaces.extraction import volumetric_spline
from polycube.spline.spaces.sharp_features import edges_between, single_hex_edges
from polycube.spline.spaces.sharpness import (
    HALVED_DETJ,
    INVALID,
    STRAIGHT,
    VOLUME,
    Creases,
    Sharp,
    Trial,
    cost,
)
from tests.fixtures.hexmeshes import hex_box

BOX = hex_box((2, 2, 2))
NONE = np.zeros((0, 2), np.int64)


def box_spline():
    return volumetric_spline(BOX, single_hex_edges(BOX))


def cost_of(spline, floor):
    return cost(min_detj(spline), deviation(spline, boundary(BOX)), floor)


def test_cost_of_an_exact_box_is_its_shortfall_of_scaled_det_j():
    assert cost_of(box_spline(), 0.1) == pytest.approx(0, abs=1e-12)
    assert cost_of(box_spline(), 4.0) == pytest.approx(2 * HALVED_DETJ, rel=1e-9)


def test_cost_has_the_larger_of_both_distances_and_the_volume():
    spline = box_spline()
    taller = replace(spline, control=spline.control * [1, 1, 1.1])
    expected = 0.1 / np.sqrt(3) + 0.1 * VOLUME
    assert cost_of(taller, 0.1) == pytest.approx(expected, rel=1e-6)


def test_cost_of_straight_hexes_is_proportional_to_their_share():
    sharp = Sharp(NONE, NONE[:, 0], np.arange(2))
    trial = Trial.of("all", box_spline(), sharp, boundary(BOX), 0.1)
    assert trial.cost == pytest.approx(STRAIGHT / 4)
    summary = "0 sharp edges and 2 straight hexes for 0.000 %, volume +0.00 % and scaled det J 1"
    assert trial.summary().replace("-0.00 %", "+0.00 %") == summary


def test_invalid_splines_cost_more_than_valid_ones_and_by_their_det_j():
    spline = box_spline()
    mirrored = replace(spline, control=spline.control * [-1, 1, 1] + [1, 0, 0])
    assert cost_of(mirrored, 0.1) == pytest.approx(INVALID + 2)


def test_all_creases_of_a_box_are_harmless():
    found = Creases(BOX, NONE, np.radians(45), True)
    every, harmless = found.all_but(NONE), found.harmless()
    on_edge = ((BOX.vertices == 0) | (BOX.vertices == 1)).sum(axis=1) >= 2
    assert np.array_equal(every.edges, edges_between(BOX, np.flatnonzero(on_edge)))
    assert np.array_equal(harmless.edges, every.edges)
    assert np.array_equal(harmless.corners, every.corners)
    assert len(every.corners) == 0  # three edges meet in each: a corner already


def test_creases_at_a_blunt_vertex_are_dropped_completely():
    lifted = BOX.vertices + 0.5 * abs(BOX.vertices[:, :1] - 0.5) * [0, 0, 1]
    mesh = hex_mesh(lifted, BOX.hexes)
    found = Creases(mesh, single_hex_edges(mesh), np.radians(20), True)
    every = found.all_but(NONE).edges
    top = np.flatnonzero((BOX.vertices[:, 0] == 0.5) & (BOX.vertices[:, 2] == 1))
    valley = edges_between(mesh, top)
    assert len(valley) == 2
    left = found.all_but(top[:1]).edges
    assert len(every) - len(left) == 2  # the other edge would end in the smooth surface


def test_no_hex_of_a_box_is_straightened():
    found = Creases(BOX, NONE, np.radians(45), True)
    assert len(found.straightened(found.all_but(NONE)).straight) == 0


def test_hexes_at_a_concave_crease_are_straightened_until_det_j_is_positive():
    bar = hex_box((4, 2, 2), (2.0, 0.5, 1.0))
    lifted = bar.vertices + 0.5 * abs(bar.vertices[:, :1] - 1) * [0, 1, 0]
    mesh = hex_mesh(lifted, bar.hexes)
    found = Creases(mesh, single_hex_edges(mesh), np.radians(45), True)
    every = found.all_but(NONE)
    assert scaled_detj(volumetric_spline(mesh, *every)).min() < 1e-9
    after = found.straightened(every)
    assert 0 < len(after.straight)
    assert min_detj(volumetric_spline(mesh, *after)).lower_bound > 0
    assert np.array_equal(after.edges, every.edges)
