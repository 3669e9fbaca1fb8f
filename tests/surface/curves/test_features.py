"""Shapes of curves that are known, in any place and size."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from polycube.surface.curves.features import Crease, shape_of

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
