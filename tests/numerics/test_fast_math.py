"""The branch-free functions compared with those of numpy."""

import numpy as np
import pytest
from numba import njit

from polycube.numerics.fast_math import exponential, inverse_cube_root

ULP = np.finfo(float).eps


@njit
def _exponentials(x):
    return np.array([exponential(each) for each in x])


@njit
def _roots(x):
    return np.array([inverse_cube_root(each) for each in x])


def test_exponential_to_the_last_places():
    x = np.concatenate([np.linspace(-700, 700, 20001), np.linspace(-1, 1, 2001)])
    assert _exponentials(x) == pytest.approx(np.exp(x), rel=4 * ULP, abs=0)
    assert _exponentials(np.zeros(1))[0] == 1


def test_exponential_stays_finite():
    ends = _exponentials(np.array([-1e9, 1e9, -np.inf, np.inf]))
    assert ends == pytest.approx(np.exp([-700, 700, -700, 700]), rel=4 * ULP, abs=0)


def test_inverse_cube_root_to_the_last_places():
    x = np.concatenate([np.geomspace(1e-300, 1e300, 20001), np.linspace(0.5, 8, 2001)])
    assert _roots(x) == pytest.approx(1 / np.cbrt(x), rel=4 * ULP, abs=0)
