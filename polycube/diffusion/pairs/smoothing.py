"""A closed surface rounded by a few steps of smoothing, in the box that it had."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix

SHORT = 1e-3  # of the longest edge of the box: shorter edges count as this long


def smoothed(vertices: np.ndarray, quads: np.ndarray, steps: int) -> np.ndarray:
    """(V, 3) vertices, each moved `steps` times half-way to the mean of its neighbours.

    A neighbour is at the other end of an edge of a quad (Q, 4), each edge being of two quads, and
    counts as one over the length of the edge: so points hardly move along a flat face.
    """
    low, extent = vertices.min(axis=0), np.ptp(vertices, axis=0)
    n = len(vertices)
    a, b = quads.ravel(), np.roll(quads, -1, axis=1).ravel()  # each edge once in each sense
    lengths = np.linalg.norm(vertices[a] - vertices[b], axis=1)
    weights = 1 / np.maximum(lengths, SHORT * extent.max())
    near, total = csr_matrix((weights, (a, b)), shape=(n, n)), np.bincount(a, weights, n)
    x = vertices
    for _ in range(steps):
        x = (x + near @ x / total[:, None]) / 2
    return (x - x.min(axis=0)) / np.ptp(x, axis=0) * extent + low
