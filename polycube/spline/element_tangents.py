"""Tangents of tricubic elements on a grid, in small batches, and the adjoint operation.

Sums are factorised: the Bezier net of an element is contracted along z, then y, then x; the adjoint
uses the reverse order. Each number of an element has a row with a lane for each of `LANES`
elements, so that the compiled loops are vectorised.
"""

import numpy as np
from numba import njit

from polycube.numerics.fast_math import FAST

LANES = 16


@njit(cache=True, error_model="numpy")
def buffers(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Buffers for net, planes, lines, tangents and determinants."""
    planes, lines = np.empty((2, 48 * LANES)), np.empty((3, 12 * LANES))
    tangents, det = np.empty((n * n, 3, 3 * LANES)), np.empty((n * n, LANES))
    return np.empty(192 * LANES), planes, lines, tangents, det


@njit(cache=True, fastmath=FAST, error_model="numpy", inline="always")
def gather(points: np.ndarray, nodes: np.ndarray, start: int, net: np.ndarray) -> None:
    """Points of the elements from `start` on, (192 LANES,); the last batch is padded."""
    for at in range(LANES):
        e = min(start + at, len(nodes) - 1)
        for k in range(64):
            for d in range(3):
                net[(3 * k + d) * LANES + at] = points[nodes[e, k], d]


@njit(cache=True, fastmath=FAST, error_model="numpy")
def tangents(
    net: np.ndarray,
    values: np.ndarray,
    slopes: np.ndarray,
    k: int,
    planes: np.ndarray,
    lines: np.ndarray,
    out: np.ndarray,
) -> None:
    """d/dx, d/dy and d/dz (n^2, 3, 3 LANES) on plane k; also fills planes and lines."""
    n = len(values)
    _combine(values[k], net, planes[0])
    _combine(slopes[k], net, planes[1])
    for j in range(n):
        _combine(values[j], planes[0], lines[0])
        _combine(slopes[j], planes[0], lines[1])
        _combine(values[j], planes[1], lines[2])
        for i in range(n):
            s = n * j + i
            _combine(slopes[i], lines[0], out[s, 0])
            _combine(values[i], lines[1], out[s, 1])
            _combine(values[i], lines[2], out[s, 2])


@njit(cache=True, fastmath=FAST, error_model="numpy")
def add_back(
    by_tangent: np.ndarray,
    values: np.ndarray,
    slopes: np.ndarray,
    k: int,
    planes: np.ndarray,
    lines: np.ndarray,
    by_net: np.ndarray,
) -> None:
    """Add the derivatives with respect to the net, from those with respect to the tangents."""
    n = len(values)
    planes[:] = 0
    for j in range(n):
        lines[:] = 0
        for i in range(n):
            s = n * j + i
            _spread(slopes[i], by_tangent[s, 0], lines[0])
            _spread(values[i], by_tangent[s, 1], lines[1])
            _spread(values[i], by_tangent[s, 2], lines[2])
        _spread(values[j], lines[0], planes[0])
        _spread(slopes[j], lines[1], planes[0])
        _spread(values[j], lines[2], planes[1])
    _spread(values[k], planes[0], by_net)
    _spread(slopes[k], planes[1], by_net)


@njit(cache=True, fastmath=FAST, error_model="numpy", inline="always")
def _combine(weights: np.ndarray, source: np.ndarray, out: np.ndarray) -> None:
    """Fill `out` (m,) with the combination of the quarters of `source` (4 m,) by weights (4,)."""
    a, b, c, d, m = weights[0], weights[1], weights[2], weights[3], len(out)
    for r in range(m):
        out[r] = a * source[r] + b * source[m + r] + c * source[2 * m + r] + d * source[3 * m + r]


@njit(cache=True, fastmath=FAST, error_model="numpy", inline="always")
def _spread(weights: np.ndarray, out: np.ndarray, source: np.ndarray) -> None:
    """The transpose of `_combine`, added to `source`."""
    m = len(out)
    for k in range(4):
        weight = weights[k]
        for r in range(m):
            source[k * m + r] += weight * out[r]
