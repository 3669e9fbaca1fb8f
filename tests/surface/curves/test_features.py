"""Shapes of curves that are known, in any place and size."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from polycube.surface.curves.features import shape_of

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
