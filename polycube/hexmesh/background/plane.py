"""Points and vectors in the plane."""

import numpy as np


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(N,) cross product of vectors (N, 2), positive if b is left of a."""
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def to_lines(points: np.ndarray, lines: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances (P, S) of points (P, 2) from lines (S, 2, 2), and the shares (P, S) along them."""
    start, step = lines[:, 0], lines[:, 1] - lines[:, 0]
    out = points[:, None] - start
    share = (out * step).sum(axis=2) / np.maximum((step**2).sum(axis=1), 1e-300)
    share = np.clip(share, 0, 1)
    return np.linalg.norm(out - share[..., None] * step, axis=2), share
