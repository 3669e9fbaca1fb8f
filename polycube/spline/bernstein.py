"""Bernstein polynomials on [0, 1] and their tensor products.

The tensor order of points and polynomials is i + (n + 1) j + (n + 1)^2 k, with i fastest.
"""

from functools import reduce

import numpy as np
from scipy.special import comb


def bernstein(t: np.ndarray, degree: int = 3) -> np.ndarray:
    """(P, degree + 1) values of B_i(t) = C(n, i) t^i (1 - t)^(n - i)."""
    i = np.arange(degree + 1)
    t = np.asarray(t, dtype=np.float64)[:, None]
    return comb(degree, i) * t**i * (1 - t) ** (degree - i)


def derivative(t: np.ndarray, degree: int = 3) -> np.ndarray:
    """(P, degree + 1) values of B_i'(t) = n (B_{i-1} - B_i), with B of degree n - 1."""
    lower = np.pad(bernstein(t, degree - 1), ((0, 0), (1, 1)))
    return degree * (lower[:, :-1] - lower[:, 1:])


def tensor(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Tensor product of three (P, n) tables as a (P^3, n^3) table, x fastest."""
    return reduce(np.kron, (z, y, x))


def volume_basis(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values (P^3, 64) and gradients (3, P^3, 64) of the tricubic basis on the grid t x t x t."""
    b, d = bernstein(t), derivative(t)
    return tensor(b, b, b), np.stack([tensor(d, b, b), tensor(b, d, b), tensor(b, b, d)])


def gauss(n: int) -> tuple[np.ndarray, np.ndarray]:
    """n Gauss points on [0, 1] and their weights; exact up to degree 2n - 1."""
    x, w = np.polynomial.legendre.leggauss(n)
    return (x + 1) / 2, w / 2
