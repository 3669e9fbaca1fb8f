"""A closed surface rounded by a few steps of smoothing, in the box that it had."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix


def smoothed(vertices: np.ndarray, quads: np.ndarray, steps: int) -> np.ndarray:
    """(V, 3) vertices, each moved `steps` times half-way to the mean of its neighbours.

    A neighbour is at the other end of an edge of a quad (Q, 4), each edge being of two quads.
    """
    n = len(vertices)
    a, b = quads.ravel(), np.roll(quads, -1, axis=1).ravel()  # each edge once in each sense
    graph = csr_matrix((np.ones(len(a)), (a, b)), shape=(n, n))
    graph.data /= np.diff(graph.indptr).repeat(np.diff(graph.indptr))
    x = vertices
    for _ in range(steps):
        x = (x + graph @ x) / 2
    low, extent = vertices.min(axis=0), np.ptp(vertices, axis=0)
    return (x - x.min(axis=0)) / np.ptp(x, axis=0) * extent + low
