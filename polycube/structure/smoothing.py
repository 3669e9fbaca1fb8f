"""Smoothing of noisy points over a graph of neighbours that keeps their volume (Taubin, 1995)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_matrix, diags
from scipy.spatial import cKDTree

SHRINK, GROW = 0.5, -0.515  # lambda and mu; frequencies up to 1 / lambda + 1 / mu = 0.06 stay


def neighbours(points: np.ndarray, k: int) -> csr_matrix:
    """(N, N) symmetric 0 or 1: whether one of two points is among the k nearest of the other."""
    n = len(points)
    nearest = cKDTree(points).query(points, min(k + 1, n))[1]
    pairs = np.repeat(np.arange(n), nearest.shape[1]), nearest.ravel()
    graph = csr_matrix((np.ones(nearest.size), pairs), shape=(n, n))
    graph = graph.maximum(graph.T)
    graph.setdiag(0)
    graph.eliminate_zeros()
    return graph


def pairs_that(
    graph: csr_matrix, hold: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> csr_matrix:
    """The graph with only those pairs of points (P,), (P,) for which `hold` is true."""
    a, b = graph.nonzero()
    kept = hold(a, b)
    return csr_matrix((np.ones(kept.sum()), (a[kept], b[kept])), shape=graph.shape)


def mean_of(graph: csr_matrix) -> csr_matrix:
    """(N, N) operator that takes the mean over neighbours; rows of points without any are empty."""
    return diags(1 / np.maximum(graph.sum(axis=1).A1, 1)) @ graph


def taubin(points: np.ndarray, graph: csr_matrix, noise: float, passes: int) -> np.ndarray:
    """(N, 3) points after as many passes as the noise calls for, and `passes` at most.

    noise : mean squared length by which points are off; smoothing stops before they have moved
        further (Morozov's discrepancy principle), so points without noise stay
    """
    mean, alone = mean_of(graph), (graph.getnnz(axis=1) == 0)[:, None]
    smooth = points
    for _ in range(passes):
        further = smooth
        for step in (SHRINK, GROW):
            further = further + step * np.where(alone, 0, mean @ further - further)
        if ((further - points) ** 2).sum(axis=1).mean() > noise:
            break
        smooth = further
    return smooth
