from dataclasses import replace

import numpy as np
import pytest

from polycube.geometry.hexes import hex_mesh
from polycube.io.hexes import boundary
from polycube.spline.extraction import volumetric_spline
from polycube.spline.features import edges_between, single_hex_edges
from polycube.spline.sharpness import INVALID, WORTH, Creases, cost
from tests.hex_solids import hex_box

BOX = hex_box((2, 2, 2))
NONE = np.zeros((0, 2), np.int64)


def box_spline():
    return volumetric_spline(BOX, single_hex_edges(BOX))


def test_a_box_is_exact_and_costs_what_its_scaled_det_j_of_one_lacks():
    assert cost(box_spline(), boundary(BOX), 0.1) == pytest.approx(0, abs=1e-12)
    assert cost(box_spline(), boundary(BOX), 4.0) == pytest.approx(2 * WORTH, rel=1e-9)


def test_the_distance_is_the_farther_of_both_ways():
    spline = box_spline()
    taller = replace(spline, control=spline.control * [1, 1, 1.1])
    assert cost(taller, boundary(BOX), 0.1) == pytest.approx(0.1 / np.sqrt(3), rel=1e-6)


def test_what_is_not_positive_costs_more_than_all_that_is_and_more_the_worse_it_is():
    spline = box_spline()
    mirrored = replace(spline, control=spline.control * [-1, 1, 1] + [1, 0, 0])
    assert cost(mirrored, boundary(BOX), 0.1) == pytest.approx(INVALID + 1)


def test_all_creases_of_a_box_are_harmless():
    found = Creases(BOX, NONE, np.radians(45), True)
    every, harmless = found.all_but(NONE), found.harmless()
    on_edge = ((BOX.vertices == 0) | (BOX.vertices == 1)).sum(axis=1) >= 2
    assert np.array_equal(every.edges, edges_between(BOX, np.flatnonzero(on_edge)))
    assert np.array_equal(harmless.edges, every.edges)
    assert np.array_equal(harmless.corners, every.corners)
    assert len(every.corners) == 0  # three edges meet in each: a corner already


def test_creases_that_meet_a_blunt_vertex_are_dropped_to_their_ends():
    lifted = BOX.vertices + 0.5 * abs(BOX.vertices[:, :1] - 0.5) * [0, 0, 1]
    mesh = hex_mesh(lifted, BOX.hexes)
    found = Creases(mesh, single_hex_edges(mesh), np.radians(20), True)
    every = found.all_but(NONE).edges
    top = np.flatnonzero((BOX.vertices[:, 0] == 0.5) & (BOX.vertices[:, 2] == 1))
    valley = edges_between(mesh, top)
    assert len(valley) == 2
    left = found.all_but(top[:1]).edges
    assert len(every) - len(left) == 2  # the other edge would end in the smooth surface
