"""Round a closed surface by a few smoothing steps, with its bounding box unchanged."""

import numpy as np
from scipy.sparse import csr_matrix

SHORT = 1e-3  # of the longest edge of the box: lower bound of the length of an edge


def smoothed(vertices: np.ndarray, quads: np.ndarray, steps: int) -> np.ndarray:
    """(V, 3) vertices after `steps` moves halfway to the mean of their neighbours.

    Neighbours are the other ends of the edges of the quads (Q, 4), where each edge belongs to two
    quads, with the inverse length of the edge as weight. Points on a flat face hardly move along
    it.
    """
    low, extent = vertices.min(axis=0), np.ptp(vertices, axis=0)
    n = len(vertices)
    a, b = quads.ravel(), np.roll(quads, -1, axis=1).ravel()  # each edge once in each direction
    lengths = np.linalg.norm(vertices[a] - vertices[b], axis=1)
    weights = 1 / np.maximum(lengths, SHORT * extent.max())
    near, total = csr_matrix((weights, (a, b)), shape=(n, n)), np.bincount(a, weights, n)
    x = vertices
    for _ in range(steps):
        x = (x + near @ x / total[:, None]) / 2
    return (x - x.min(axis=0)) / np.ptp(x, axis=0) * extent + low
