"""More parts along curved edges, on a block whose edges are curved only along x."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.fitting.creases import chord_counts
from polycube.fitting.creases.chord_counts import finer_along
from polycube.hexmesh.generation.interval_counts import Lattice
from polycube.hexmesh.generation.sizing import number_of_hexes
from polycube.hexmesh.generation.template import mesh
from polycube.structure.rough_map import affine_map
from polycube.surface.fit_target import target
from polycube.types import Polycube, TriMesh

BLOCK = Polycube(np.ones((2, 1, 1)), [0, 1, 2], [0, 1], [0, 1], (1, 1, 1), ("cube",))
PLENTY = 10**6


def block(parts, bulge=0.2):
    """Block with the given parts of each interval; its y sides bulge as a parabola in x."""
    straight = mesh(BLOCK, affine_map(BLOCK, 2 * np.eye(3), [-2, -1, -1]), parts)
    x = straight.vertices.copy()
    x[:, 1] *= 1 + bulge * (1 - (x[:, 0] / 2) ** 2)
    return replace(straight, vertices=x)


def parts_of(x, y, z):
    return np.array(x), np.array([y]), np.array([z])


def surface(bulge=0.2):
    fine = block(parts_of([64, 64], 2, 2), bulge)
    used, quads = np.unique(fine.quads, return_inverse=True)
    quads = quads.reshape(-1, 4)
    return TriMesh(fine.vertices[used], np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]))


def found_by(wanted, bulge=0.2, most=PLENTY, counts=None):
    few = parts_of([3, 3], 3, 3)
    counts = few if counts is None else counts
    goal = target(surface(bulge))
    lattice = Lattice(BLOCK, block(few, bulge), few)
    found = finer_along(lattice, counts, goal, wanted, most)
    return [number.tolist() for number in found]


def test_straight_edges_need_no_more_parts():
    assert found_by(1e-4, bulge=0.0) == [[3, 3], [3], [3]]


def test_chords_within_the_distance_need_no_more_parts():
    assert found_by(0.01) == [[3, 3], [3], [3]]


def test_only_intervals_along_curved_edges_get_more_parts():
    # an edge of length h is h^2 / 8 R off, and R = 2^2 / (2 * 0.2) in the middle of x
    unit = np.linalg.norm(np.ptp(surface().vertices, axis=0))
    off = (4 / 6) ** 2 / 8 / 10 / unit
    found = found_by(off / 1.5)
    assert sum(found[0]) == pytest.approx(6 * 1.5**0.5, abs=1) and sum(found[0]) > 6
    assert found[1:] == [[3], [3]]
    assert abs(found[0][0] - found[0][1]) <= 1


def test_the_distance_is_increased_until_the_hexes_are_permitted():
    few = parts_of([3, 3], 3, 3)
    found = found_by(1e-6)
    assert [3, 3] < found[0] and found[1:] == [[3], [3]]
    assert number_of_hexes(BLOCK, [np.array(n) for n in found]) <= 1.5 * number_of_hexes(BLOCK, few)
    assert found_by(1e-6, most=1) == [[3, 3], [3], [3]]


def test_existing_parts_are_counted():
    assert found_by(1e-3, counts=parts_of([20, 20], 3, 3)) == [[20, 20], [3], [3]]


def test_counts_are_unchanged_if_every_distance_needs_too_many_hexes(monkeypatch):
    """A loop of less than three edges needs three at any distance."""
    monkeypatch.setattr(chord_counts, "raised", lambda *given: parts_of([30, 30], 30, 30))
    assert found_by(1e-3) == [[3, 3], [3], [3]]
