"""Displacements that are given at some vertices of a mesh and harmonic at the others."""

import numpy as np
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import cg


def harmonic(x: np.ndarray, ends: np.ndarray, free: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """(V, D) displacement equal to `shift`, and harmonic on a graph at its free vertices.

    The conductance of an edge is its inverse length, so the ends of a short edge move together.

    x : (V, 3) vertices
    ends : (E, 2) edges
    free : (N,) vertices; each is connected to one that is not free
    shift : (V, D) displacement; not used at free vertices
    """
    length = np.linalg.norm(x[ends[:, 0]] - x[ends[:, 1]], axis=1)
    conducts = np.tile(1 / np.maximum(length, 1e-3 * length.mean()), 2)
    pairs = np.append(ends[:, 0], ends[:, 1]), np.append(ends[:, 1], ends[:, 0])
    graph = coo_matrix((conducts, pairs), (len(x), len(x))).tocsr()
    total = np.asarray(graph.sum(axis=1)).ravel()
    moved = shift.copy()
    moved[free] = 0
    matrix, right = diags(total[free]) - graph[free][:, free], graph[free] @ moved
    scale = diags(1 / total[free])
    for d in range(shift.shape[1]):
        moved[free, d], _ = cg(matrix, right[:, d], rtol=1e-4, maxiter=500, M=scale)
    return moved
