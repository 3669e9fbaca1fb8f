"""Compiled elastic forces of tricubic elements: sums are factorised, nothing is stored.

The Bezier net of an element is contracted along z, then y, then x; the adjoint uses the reverse
order. Each number of an element has a row with a lane for each of `LANES` elements, so that the
compiled loops are vectorised.
"""

from functools import partial, reduce

import numpy as np
from numba import njit

from polycube.analysis.problem import Material
from polycube.numerics.fast_math import FAST
from polycube.numerics.threads import parts, side_by_side
from polycube.spline.bernstein import bernstein, derivative, gauss

LANES = 16  # elements in a batch
LEAST = 64  # smallest number of elements for a thread


def elastic_forces(
    points: np.ndarray,
    nodes: np.ndarray,
    displacement: np.ndarray,
    n_gauss: int,
    solid: Material,
    to_bezier: np.ndarray,
) -> np.ndarray:
    """(B, 3) forces K u of the functions of the nodes.

    points, displacement : (B, 3) coefficients.  nodes : (E, 64)
    to_bezier : (4, 4) Bezier coefficients on a line from these
    """
    line, weights = gauss(n_gauss)
    values, slopes = (basis(line) @ to_bezier for basis in (bernstein, derivative))
    given = values, slopes, weights, np.outer(weights, weights).ravel()
    displacement = np.ascontiguousarray(displacement)
    moduli = np.zeros((len(nodes), 2)) + np.column_stack([solid.shear, solid.lame])
    work = [
        partial(_forces, points, nodes[p], displacement, *given, moduli[p])
        for p in parts(len(nodes), LEAST)
    ]
    return reduce(np.add, side_by_side(work))


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _forces(
    points: np.ndarray,
    nodes: np.ndarray,
    displacement: np.ndarray,
    values: np.ndarray,
    slopes: np.ndarray,
    weights: np.ndarray,
    square: np.ndarray,
    moduli: np.ndarray,
) -> np.ndarray:
    """(B, 3) forces of some elements; values, slopes (n, 4), weights (n,) on a line, and (n^2,)."""
    n = len(values)
    found, of_lanes = np.zeros(points.shape), np.empty((2, LANES))
    net, place = np.empty(192 * LANES), np.empty((n * n, 3, 3 * LANES))
    moved, by_net, slope = np.empty_like(net), np.empty_like(net), np.empty_like(place)
    planes, lines = np.empty((2, 48 * LANES)), np.empty((3, 12 * LANES))
    for start in range(0, len(nodes), LANES):
        _gather(points, nodes, start, net)
        _gather(displacement, nodes, start, moved)
        for at in range(LANES):
            of_lanes[0, at], of_lanes[1, at] = moduli[min(start + at, len(nodes) - 1)]
        by_net[:] = 0
        for k in range(n):
            _tangents(net, values, slopes, k, planes, lines, place)
            _tangents(moved, values, slopes, k, planes, lines, slope)
            _resist(place, slope, weights[k] * square, of_lanes[0], of_lanes[1])
            _add_back(slope, values, slopes, k, planes, lines, by_net)
        for at in range(min(LANES, len(nodes) - start)):
            for r in range(64):
                for d in range(3):
                    found[nodes[start + at, r], d] += by_net[(3 * r + d) * LANES + at]
    return found


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _resist(
    place: np.ndarray, slope: np.ndarray, weights: np.ndarray, shear: np.ndarray, lame: np.ndarray
) -> None:
    """Replace the derivatives of u on a plane by those of the energy with respect to them.

    place, slope : (n^2, 3, 3 LANES) derivatives of the points and of u by the parameters
    weights : (n^2,) of the Gauss points.  shear, lame : (LANES,) moduli

    With the cofactors c_k of the Jacobian matrix, du/dx = sum_k du/dk c_k / det J.
    """
    cofactor, strain = np.empty((3, 3, LANES)), np.empty((3, 3, LANES))
    for s in range(len(weights)):
        for k in range(3):
            b, c, own = place[s, (k + 1) % 3], place[s, (k + 2) % 3], cofactor[k]
            for x in range(LANES):
                y, z = LANES + x, 2 * LANES + x
                own[0, x] = b[y] * c[z] - b[z] * c[y]
                own[1, x] = b[z] * c[x] - b[x] * c[z]
                own[2, x] = b[x] * c[y] - b[y] * c[x]
        for i in range(3):
            for d in range(3):
                a, out = d * LANES, strain[i, d]
                for x in range(LANES):
                    out[x] = (
                        slope[s, 0, a + x] * cofactor[0, i, x]
                        + slope[s, 1, a + x] * cofactor[1, i, x]
                        + slope[s, 2, a + x] * cofactor[2, i, x]
                    )
        for x in range(LANES):
            det = (
                place[s, 0, x] * cofactor[0, 0, x]
                + place[s, 0, LANES + x] * cofactor[0, 1, x]
                + place[s, 0, 2 * LANES + x] * cofactor[0, 2, x]
            )
            mu = shear[x] * weights[s] / det
            dilation = strain[0, 0, x] + strain[1, 1, x] + strain[2, 2, x]
            spread = lame[x] * weights[s] / det * dilation
            for i in range(3):
                for d in range(i):
                    both = mu * (strain[i, d, x] + strain[d, i, x])
                    strain[i, d, x], strain[d, i, x] = both, both
                strain[i, i, x] = 2 * mu * strain[i, i, x] + spread
        for k in range(3):
            for d in range(3):
                a = d * LANES
                for x in range(LANES):
                    slope[s, k, a + x] = (
                        strain[0, d, x] * cofactor[k, 0, x]
                        + strain[1, d, x] * cofactor[k, 1, x]
                        + strain[2, d, x] * cofactor[k, 2, x]
                    )


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _gather(points: np.ndarray, nodes: np.ndarray, start: int, net: np.ndarray) -> None:
    """Points of the elements from `start` on, (192 LANES,); the last batch is padded."""
    for at in range(LANES):
        e = min(start + at, len(nodes) - 1)
        for k in range(64):
            for d in range(3):
                net[(3 * k + d) * LANES + at] = points[nodes[e, k], d]


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _tangents(
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
def _add_back(
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


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _combine(weights: np.ndarray, source: np.ndarray, out: np.ndarray) -> None:
    """Fill `out` (m,) with the combination of the quarters of `source` (4 m,) by weights (4,)."""
    a, b, c, d, m = weights[0], weights[1], weights[2], weights[3], len(out)
    for r in range(m):
        out[r] = a * source[r] + b * source[m + r] + c * source[2 * m + r] + d * source[3 * m + r]


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _spread(weights: np.ndarray, out: np.ndarray, source: np.ndarray) -> None:
    """The transpose of `_combine`, added to `source`."""
    m = len(out)
    for k in range(4):
        weight = weights[k]
        for r in range(m):
            source[k * m + r] += weight * out[r]
