"""Energy of a hex mesh with its gradient: shape, soft minimum of the scaled Jacobian, springs.

Nine frames per hex: its eight corners and the mean of its edges in each direction (the centre
frame of VTK's scaled Jacobian).  With a, b, c the frame's edges, D = det [a b c] and
d, S the determinant and squared norm of the edges over their wanted lengths,

    shape   S / (3 chi^2/3) + barrel (d^2 + 1) / (2 chi),   chi = (d + sqrt(eps^2 + d^2)) / 2
    jacobian  exp(-beta (D / |a||b||c| - offset)) / beta

summed over the frames and divided by 8 (Garanzha et al. 2021 for the shape term).  A state with
d below `floor` in any frame has infinite energy: valid hexes stay valid.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from numba import njit

from polycube.hexmesh.connectivity import CORNERS, EDGES
from polycube.numerics.fast_math import FAST, exponential, inverse_cube_root
from polycube.numerics.threads import parts, side_by_side

# frames as edges of the hex (12, 13, 14: mean edge along xi, eta, zeta) with the sign of their
# determinant, and the direction of each edge
_EDGE = np.argmax(
    (np.sort(CORNERS[:, [[0, 1], [0, 2], [0, 3]]])[:, :, None] == np.sort(EDGES)).all(axis=3),
    axis=2,
)
_SIGN = np.append(np.where(EDGES[_EDGE, 0] == CORNERS[:, :1], 1.0, -1.0).prod(axis=1), 1.0)
_EDGE = np.vstack([_EDGE, [12, 13, 14]])
_DIRECTION = np.vstack([_EDGE[:8] // 4, [0, 1, 2]])
_TINY = 1e-30
LANES = 32  # hexes that the energy takes at a time
LEAST = 3000  # hexes for a thread


class Terms(NamedTuple):
    """Weights of the two hex terms and the bound on the determinants."""

    shape: float = 1.0
    eps: float = 1e-3
    barrel: float = 0.1
    jacobian: float = 0.0
    beta: float = 1.0
    offset: float = 0.0
    floor: float = -np.inf


class Springs(NamedTuple):
    """Quadratic pulls: sum along (n . r)^2 + every |r|^2 with r = sum_k share_k x_k - goal."""

    vertex: np.ndarray  # (S, 4) int64
    share: np.ndarray  # (S, 4)
    goal: np.ndarray  # (S, 3)
    direction: np.ndarray  # (S, 3) unit vectors n
    along: np.ndarray  # (S,)
    every: np.ndarray  # (S,)


def pull(
    vertex: np.ndarray,
    goal: np.ndarray,
    direction: np.ndarray,
    along: np.ndarray,
    every: np.ndarray,
) -> Springs:
    """Springs on single vertices (S,)."""
    index = np.repeat(vertex[:, None], 4, axis=1)
    share = np.tile([1.0, 0, 0, 0], (len(vertex), 1))
    return Springs(index, share, goal, direction, along, every)


def together(springs: list[Springs]) -> Springs:
    """All springs of a list."""
    return Springs(
        *(np.ascontiguousarray(np.concatenate(part)) for part in zip(*springs, strict=True))
    )


def energy(
    x: np.ndarray, hexes: np.ndarray, lengths: np.ndarray, terms: Terms, springs: Springs
) -> tuple[float, np.ndarray]:
    """Energy and gradient (V, 3); infinite, with a useless gradient, below the floor.

    x : (V, 3), lengths : (H, 3) wanted edge lengths along xi, eta, zeta
    """
    terms = Terms(*map(float, terms))
    cuts = parts(len(hexes), LEAST)
    gradients = np.zeros((len(cuts), *x.shape))
    values = side_by_side(
        [
            partial(_hex_energy, x, hexes, lengths, terms, gradient, cut.start, cut.stop)
            for cut, gradient in zip(cuts, gradients, strict=True)
        ]
    )
    value, gradient = sum(values), gradients.sum(axis=0)
    if np.isfinite(value):
        value += _spring_energy(x, springs, gradient)
    return value, gradient


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def least_determinant(x: np.ndarray, hexes: np.ndarray, lengths: np.ndarray) -> float:
    """Smallest d of all frames."""
    least = np.inf
    edge = np.zeros((15, 3))
    for h in range(len(hexes)):
        _load(x, hexes[h], edge)
        scale = 1 / (lengths[h, 0] * lengths[h, 1] * lengths[h, 2])
        for f in range(9):
            a, b, c = edge[_EDGE[f, 0]], edge[_EDGE[f, 1]], edge[_EDGE[f, 2]]
            least = min(least, _SIGN[f] * _dot(a, _cross(b, c)) * scale)
    return least


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def scaled_jacobian(x: np.ndarray, hexes: np.ndarray) -> np.ndarray:
    """(H,) smallest scaled Jacobian over corners and centre; -1 where an edge has no length."""
    result = np.ones(len(hexes))
    edge = np.zeros((15, 3))
    for h in range(len(hexes)):
        _load(x, hexes[h], edge)
        for f in range(9):
            a, b, c = edge[_EDGE[f, 0]], edge[_EDGE[f, 1]], edge[_EDGE[f, 2]]
            size = np.sqrt(_dot(a, a)) * np.sqrt(_dot(b, b)) * np.sqrt(_dot(c, c))
            value = _SIGN[f] * _dot(a, _cross(b, c)) / size if size > 0 else -1.0
            result[h] = min(result[h], max(value, -1.0))
    return result


@njit(cache=True, fastmath=FAST, error_model="numpy", inline="always")
def _load(x, hex, edge):
    """The 12 edges of a hex and their means in each direction."""
    for d in range(3):
        for k in range(12):
            edge[k, d] = x[hex[EDGES[k, 1]], d] - x[hex[EDGES[k, 0]], d]
        for k in range(3):
            mean = edge[4 * k, d] + edge[4 * k + 1, d] + edge[4 * k + 2, d] + edge[4 * k + 3, d]
            edge[12 + k, d] = mean / 4


@njit(cache=True, fastmath=FAST, error_model="numpy", inline="always")
def _cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@njit(cache=True, fastmath=FAST, error_model="numpy", inline="always")
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _hex_energy(x, hexes, lengths, terms, gradient, begin, end):
    """Sum over hexes begin to end; adds to the gradient, by way of that by the edges of each hex.

    LANES hexes at a time, number by number, so that the loops over them are vectorised.
    """
    total = 0.0
    corner, weight = np.empty((24, LANES)), np.empty((4, LANES))
    edge, by_edge, out = np.empty((45, LANES)), np.empty((45, LANES)), np.empty((6, LANES))
    least = np.empty(LANES)
    for start in range(begin, end, LANES):
        n = min(LANES, end - start)
        _gather(x, hexes, lengths, start, n, corner, weight)
        _edges(corner, edge)
        by_edge[:] = 0.0
        least[:] = np.inf
        for f in range(9):
            i, j, k = 3 * _EDGE[f, 0], 3 * _EDGE[f, 1], 3 * _EDGE[f, 2]
            _frame(edge, weight, i, j, k, _DIRECTION[f], _SIGN[f], terms, out)
            _add_cross(by_edge, edge, i, j, k, out, 2)
            _add_cross(by_edge, edge, j, k, i, out, 3)
            _add_cross(by_edge, edge, k, i, j, out, 4)
            for at in range(LANES):
                least[at] = min(least[at], out[5, at])
            for at in range(n):
                total += out[0, at]
        for at in range(n):
            if least[at] < terms.floor:
                return np.inf
        _scatter(by_edge, hexes, start, n, corner, gradient)
    return total / 8


@njit(cache=True, fastmath=FAST, error_model="numpy", inline="always")
def _gather(x, hexes, lengths, start, n, corner, weight):
    """Corners of hexes, and the weights of their edges and determinants; the last fills up."""
    for at in range(LANES):
        h = start + min(at, n - 1)
        for k in range(8):
            for d in range(3):
                corner[3 * k + d, at] = x[hexes[h, k], d]
        product = 1.0
        for d in range(3):
            inverse = 1 / lengths[h, d]
            weight[d, at] = inverse * inverse
            product *= inverse
        weight[3, at] = product


@njit(cache=True, fastmath=FAST, error_model="numpy", inline="always")
def _edges(corner, edge):
    """The 12 edges and their means in each direction."""
    for k in range(12):
        p, q = 3 * EDGES[k, 0], 3 * EDGES[k, 1]
        for d in range(3):
            for at in range(LANES):
                edge[3 * k + d, at] = corner[q + d, at] - corner[p + d, at]
    for k in range(3):
        for r in range(12 * k, 12 * k + 3):
            for at in range(LANES):
                mean = edge[r, at] + edge[r + 3, at] + edge[r + 6, at] + edge[r + 9, at]
                edge[36 + r - 9 * k, at] = mean / 4


@njit(cache=True, fastmath=FAST, error_model="numpy", inline="always")
def _frame(edge, weight, i, j, k, direction, sign, terms, out):
    """Of the frame of edges at rows i, j, k: value, derivative by the determinant, factors of a,
    b, c in the gradients by a, b, c, and d.
    """
    p, q, r = direction
    for at in range(LANES):
        a = (edge[i, at], edge[i + 1, at], edge[i + 2, at])
        b = (edge[j, at], edge[j + 1, at], edge[j + 2, at])
        c = (edge[k, at], edge[k + 1, at], edge[k + 2, at])
        det = sign * _dot(a, _cross(b, c))
        a2, b2, c2 = _dot(a, a) + _TINY, _dot(b, b) + _TINY, _dot(c, c) + _TINY
        wa, wb, wc, scale = weight[p, at], weight[q, at], weight[r, at], weight[3, at]
        d = det * scale
        norm = a2 * wa + b2 * wb + c2 * wc
        root = np.sqrt(terms.eps * terms.eps + d * d)
        third = inverse_cube_root(max(0.5 * (d + root), 1e-12))
        power, inverse = third * third, third * third * third
        spread = terms.barrel * 0.5 * (d * d + 1) * inverse
        slope = (-2 / 9 * norm * power - spread) * 0.5 * (1 + d / root) + terms.barrel * d
        factor = terms.shape * 2 / 3 * power
        ia, ib, ic = 1 / a2, 1 / b2, 1 / c2
        per_size = np.sqrt(ia * ib * ic)
        s = det * per_size
        v = terms.jacobian * exponential(-terms.beta * (s - terms.offset))
        out[0, at] = terms.shape * (norm * power / 3 + spread) + v / terms.beta
        out[1, at] = sign * (terms.shape * scale * slope * inverse - v * per_size)
        out[2, at] = factor * wa + v * s * ia
        out[3, at] = factor * wb + v * s * ib
        out[4, at] = factor * wc + v * s * ic
        out[5, at] = d


@njit(cache=True, fastmath=FAST, error_model="numpy", inline="always")
def _add_cross(by_edge, edge, i, j, k, out, row):
    """Add the gradient by the edge at row i: its factor times a, the determinant's times b x c."""
    for at in range(LANES):
        b = (edge[j, at], edge[j + 1, at], edge[j + 2, at])
        c = (edge[k, at], edge[k + 1, at], edge[k + 2, at])
        bc = _cross(b, c)
        by_edge[i, at] += out[row, at] * edge[i, at] + out[1, at] * bc[0]
        by_edge[i + 1, at] += out[row, at] * edge[i + 1, at] + out[1, at] * bc[1]
        by_edge[i + 2, at] += out[row, at] * edge[i + 2, at] + out[1, at] * bc[2]


@njit(cache=True, fastmath=FAST, error_model="numpy", inline="always")
def _scatter(by_edge, hexes, start, n, corner, gradient):
    """Add the gradients by the edges to those by the vertices, by way of the corners' array."""
    corner[:] = 0.0
    for e in range(12):
        p, q = 3 * EDGES[e, 0], 3 * EDGES[e, 1]
        for d in range(3):
            for at in range(LANES):
                g = (by_edge[3 * e + d, at] + by_edge[36 + e // 4 * 3 + d, at] / 4) / 8
                corner[p + d, at] -= g
                corner[q + d, at] += g
    for at in range(n):
        for k in range(8):
            for d in range(3):
                gradient[hexes[start + at, k], d] += corner[3 * k + d, at]


@njit(cache=True, nogil=True)
def _spring_energy(x, springs, gradient):
    total = 0.0
    for s in range(len(springs.goal)):
        r0, r1, r2 = -springs.goal[s, 0], -springs.goal[s, 1], -springs.goal[s, 2]
        for k in range(4):
            share, v = springs.share[s, k], springs.vertex[s, k]
            if share != 0:
                r0 += share * x[v, 0]
                r1 += share * x[v, 1]
                r2 += share * x[v, 2]
        n = springs.direction[s]
        off = r0 * n[0] + r1 * n[1] + r2 * n[2]
        along, every = springs.along[s], springs.every[s]
        total += along * off * off + every * (r0 * r0 + r1 * r1 + r2 * r2)
        g0 = 2 * (along * off * n[0] + every * r0)
        g1 = 2 * (along * off * n[1] + every * r1)
        g2 = 2 * (along * off * n[2] + every * r2)
        for k in range(4):
            share, v = springs.share[s, k], springs.vertex[s, k]
            if share != 0:
                gradient[v, 0] += share * g0
                gradient[v, 1] += share * g1
                gradient[v, 2] += share * g2
    return total
