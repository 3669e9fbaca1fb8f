"""Vectors in the plane."""

import numpy as np


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(N,) cross product of vectors (N, 2), positive if b is left of a."""
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
