"""Shapes of curves that are known, in any place and size."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from polycube.surface.curves.features import Crease, shape_of
from tests.fixtures.surfaces import circle

T = np.linspace(0, 1, 30)


def arc(angle):
    return np.column_stack([np.cos(angle * T), np.sin(angle * T), 0 * T])


CURVES = {
    "line": [np.column_stack([T**2, 0 * T, 0 * T]), np.array([[0.0, 0, 0], [1, 0, 0]])],
    "circle": [arc(0.5), arc(2.0), arc(2 * np.pi)],
    "curve": [
        arc(2 * np.pi) * [1, 0.9, 1],
        np.column_stack([T, T**2, 0 * T]),
        arc(3.0) + np.column_stack([0 * T, 0 * T, T]),
        np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0]]),
    ],
}


@pytest.mark.parametrize("shape", CURVES)
@given(seed=st.integers(0, 10**6), size=st.floats(1e-3, 1e3))
def test_shapes_in_any_place(shape, seed, size):
    place = Rotation.random(random_state=seed)
    for points in CURVES[shape]:
        assert shape_of(size * place.apply(points) + 7 * size) == shape


def square(is_loop: bool) -> Crease:
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 0]], float)
    ends = (-1, -1) if is_loop else (3, 4)
    return Crease(points, np.arange(5.0), np.array([1.0, 2, 3, 4]), ends, (5, 6))


def test_a_piece_of_a_curve():
    piece = square(False).piece(0.5, 2.25)
    assert piece.points.tolist() == [[0.5, 0, 0], [1, 0, 0], [1, 1, 0], [0.75, 1, 0]]
    assert piece.arc.tolist() == [0, 0.5, 1.5, 1.75]
    assert piece.inside.tolist() == [1, 2, 3]
    assert piece.faces == (5, 6)
    assert not piece.is_loop


@pytest.mark.parametrize("start", [3.5, 7.5, -0.5])
def test_a_piece_of_a_loop_passes_its_seam(start):
    piece = square(True).piece(start, start + 1)
    assert piece.points.tolist() == [[0, 0.5, 0], [0, 0, 0], [0.5, 0, 0]]
    assert piece.length == 1
    assert piece.inside.tolist() == [4, 1]
    assert not piece.is_loop


def polyline(points: np.ndarray) -> Crease:
    """An open curve."""
    arc = np.append(0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    return Crease(points, arc, np.full(len(points) - 1, np.pi / 2), (0, 1))


@pytest.mark.parametrize("share", [0.1, 0.25, 0.5, 0.75])
def test_the_size_of_an_arc_is_half_its_radius_but_not_more_than_its_extent(share):
    angle = 2 * np.pi * share * np.linspace(0, 1, 101)
    arc = polyline(0.3 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1))
    assert arc.shape == "circle"
    extent = 0.6 * np.sin(np.pi * min(share, 0.5))
    assert arc.size == pytest.approx(min(0.15, extent), rel=0.01)


def test_the_size_of_another_curve_is_its_extent():
    t = np.linspace(0, 1, 101)
    line = polyline(np.stack([0.3 * t, 0.4 * t, 0 * t], axis=1))
    assert line.size == pytest.approx(0.5)
    wave = polyline(np.stack([0.5 * t, np.sin(12 * t) / 10, 0 * t], axis=1))
    assert wave.shape == "curve"
    extent = np.linalg.norm(wave.points[:, None] - wave.points, axis=2).max()
    assert wave.size == pytest.approx(extent, rel=0.01)
    assert circle().size == pytest.approx(0.5, rel=0.01)


@pytest.mark.parametrize("curve", [circle(), square(False)])
def test_a_piece_has_the_size_of_the_whole_curve(curve):
    assert curve.piece(0.5, 1.5).piece(0.2, 0.4).size == curve.size > 0.3
