"""Cuts of sections at re-entrant corners, and the grids between them."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycube.hexmesh.background.curves import Curve, Sizes
from polycube.hexmesh.background.cuts import LONGEST, cuts
from polycube.hexmesh.background.section import section_of
from polycube.hexmesh.background.smoothing import sines
from polycube.plugins.structure.background.stack import stack
from polycube.types import TriMesh
from tests.fixtures.machined import prism

ELL = (0, 0), (4, 0), (4, 1), (2, 1), (2, 3), (0, 3)
TEE = (0, 0), (6, 0), (6, 3), (4, 3), (4, 7), (2, 7), (2, 3), (0, 3)
WEDGE = (0, 0), (4, -1), (4, 1), (2, 1), (2, 3), (0, 3)  # the side below is oblique
SIZES = Sizes(size=1.0, chord=0.05, across_wall=2, around_hole=12)


def across(*outline: tuple[float, float], size: float = 1.0) -> np.ndarray:
    """Cuts of a polygon whose sides are its curves."""
    at = np.array([*outline, outline[0]], float)
    sides = [Curve(np.array([2 * k]), at[k : k + 2]) for k in range(len(outline))]
    return cuts(sides, [[list(range(1, len(outline) + 1))]], size)


def test_an_angle_is_cut_along_the_shorter_way():
    assert across(*ELL) == pytest.approx(np.array([[[2, 1], [2, 0]]]))


def test_both_corners_of_a_tee_have_the_same_cut():
    assert across(*TEE) == pytest.approx(np.array([[[4, 3], [2, 3]], [[2, 3], [4, 3]]]))


def test_a_cut_ends_at_a_corner_that_is_nearly_opposite():
    """The foot at (2, 0) is 0.2 from a corner, a fifth of the length of the cut."""
    moved = (0, 0), (2.2, 0), (4, 0.5), *ELL[2:]
    assert across(*moved) == pytest.approx(np.array([[[2, 1], [2.2, 0]]]))


def test_long_and_oblique_cuts_are_left_out():
    assert not len(across(*ELL, size=0.9 / LONGEST))
    assert len(across(*ELL, size=1.1 / LONGEST)) == 1
    steep = (0, 2), (4, -6), *WEDGE[2:]
    assert across(*steep) == pytest.approx(np.array([[[2, 1], [0.5, 1]]]))


@given(st.floats(0, 2 * np.pi), st.floats(0.1, 10))
def test_cuts_turn_and_scale_with_the_section(turn, scale):
    rows = scale * np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    for outline in (ELL, TEE, WEDGE):
        moved = across(*map(tuple, np.array(outline) @ rows), size=scale)
        assert moved == pytest.approx(across(*outline) @ rows, abs=1e-9 * scale)


def inner_degrees(surface: TriMesh, is_round: bool) -> np.ndarray:
    """(N,) number of quads at the inner vertices of the section of a prism."""
    part, _ = stack(surface, SIZES)
    part = replace(part, marks=part.marks[:0]) if is_round else part
    flat, _, _ = section_of(surface, part, SIZES)
    assert sines(flat.vertices, flat.quads).min() > 0.9
    sides = np.sort(np.stack([flat.quads, np.roll(flat.quads, -1, axis=1)], axis=2), axis=2)
    edges, number = np.unique(sides.reshape(-1, 2), axis=0, return_counts=True)
    return np.delete(np.bincount(flat.quads.ravel()), np.unique(edges[number == 1]))


def test_a_ring_with_a_slit_has_quads_along_and_across_it():
    turn = np.radians(np.linspace(20, 340, 57))
    inner = 2.2 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    quads = [(k, k + 57, k + 58, k + 1) for k in range(56)]
    degrees = inner_degrees(prism(([*inner, *(4 / 2.2 * inner)], quads)), is_round=True)
    assert len(degrees) > 10 and (degrees == 4).all()


def test_a_tee_has_a_regular_grid():
    cells = [(0, 8, 6, 7), (8, 9, 3, 6), (9, 1, 2, 3), (6, 3, 4, 5)]
    degrees = inner_degrees(prism(([*TEE, (2, 0), (4, 0)], cells)), is_round=False)
    assert len(degrees) > 10 and (degrees == 4).all()
