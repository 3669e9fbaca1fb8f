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

from typing import NamedTuple

import numpy as np
from numba import njit

from polycube.geometry.hexes import CORNERS, EDGES

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
_FAST = {"reassoc", "contract", "arcp", "nsz"}  # but infinite values stay what they are


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
    gradient = np.zeros_like(x)
    value = _hex_energy(x, hexes, lengths, Terms(*map(float, terms)), gradient)
    if np.isfinite(value):
        value += _spring_energy(x, springs, gradient)
    return value, gradient


@njit(cache=True, fastmath=_FAST)
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


@njit(cache=True, fastmath=_FAST)
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


@njit(cache=True, fastmath=_FAST, inline="always")
def _load(x, hex, edge):
    """The 12 edges of a hex and their means in each direction."""
    for d in range(3):
        for k in range(12):
            edge[k, d] = x[hex[EDGES[k, 1]], d] - x[hex[EDGES[k, 0]], d]
        for k in range(3):
            mean = edge[4 * k, d] + edge[4 * k + 1, d] + edge[4 * k + 2, d] + edge[4 * k + 3, d]
            edge[12 + k, d] = mean / 4


@njit(cache=True, fastmath=_FAST, inline="always")
def _cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@njit(cache=True, fastmath=_FAST, inline="always")
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, fastmath=_FAST, inline="always")
def _frame_energy(a2, b2, c2, det, wa, wb, wc, terms):
    """Value, derivative by det, and factors of a, b, c in the gradients by a, b, c."""
    value, by_det, fa, fb, fc = 0.0, 0.0, 0.0, 0.0, 0.0
    if terms.shape > 0:
        scale = np.sqrt(wa * wb * wc)
        d = det * scale
        norm = a2 * wa + b2 * wb + c2 * wc
        root = np.sqrt(terms.eps * terms.eps + d * d)
        inverse = 1 / max(0.5 * (d + root), 1e-12)
        power = np.cbrt(inverse * inverse)
        spread = 0.5 * (d * d + 1) * inverse
        value += terms.shape * (norm * power / 3 + terms.barrel * spread)
        by_chi = -2 / 9 * norm * power - terms.barrel * spread
        slope = 0.5 * (1 + d / root)
        by_det += terms.shape * scale * (by_chi * slope + terms.barrel * d) * inverse
        factor = terms.shape * 2 / 3 * power
        fa, fb, fc = factor * wa, factor * wb, factor * wc
    if terms.jacobian > 0:
        inverse = 1 / np.sqrt(a2 * b2 * c2)
        s = det * inverse
        v = terms.jacobian * np.exp(-terms.beta * (s - terms.offset))
        value += v / terms.beta
        by_det -= v * inverse
        fa, fb, fc = fa + v * s / a2, fb + v * s / b2, fc + v * s / c2
    return value, by_det, fa, fb, fc


@njit(cache=True, fastmath=_FAST)
def _hex_energy(x, hexes, lengths, terms, gradient):
    """Sum over hexes; adds to the gradient, by way of that by the edges of each hex."""
    total = 0.0
    edge, by_edge = np.zeros((15, 3)), np.zeros((15, 3))
    for h in range(len(hexes)):
        _load(x, hexes[h], edge)
        w = (lengths[h, 0] ** -2, lengths[h, 1] ** -2, lengths[h, 2] ** -2)
        floor = terms.floor * lengths[h, 0] * lengths[h, 1] * lengths[h, 2]
        for k in range(15):
            by_edge[k, 0] = by_edge[k, 1] = by_edge[k, 2] = 0.0
        for f in range(9):
            i, j, k = _EDGE[f, 0], _EDGE[f, 1], _EDGE[f, 2]
            a = (edge[i, 0], edge[i, 1], edge[i, 2])
            b = (edge[j, 0], edge[j, 1], edge[j, 2])
            c = (edge[k, 0], edge[k, 1], edge[k, 2])
            bc, ca, ab = _cross(b, c), _cross(c, a), _cross(a, b)
            det = _SIGN[f] * _dot(a, bc)
            if det < floor:
                return np.inf
            wa, wb, wc = w[_DIRECTION[f, 0]], w[_DIRECTION[f, 1]], w[_DIRECTION[f, 2]]
            a2, b2, c2 = _dot(a, a) + _TINY, _dot(b, b) + _TINY, _dot(c, c) + _TINY
            value, by_det, fa, fb, fc = _frame_energy(a2, b2, c2, det, wa, wb, wc, terms)
            total += value
            by_det *= _SIGN[f]
            for d in range(3):
                by_edge[i, d] += fa * a[d] + by_det * bc[d]
                by_edge[j, d] += fb * b[d] + by_det * ca[d]
                by_edge[k, d] += fc * c[d] + by_det * ab[d]
        for e in range(12):
            for d in range(3):
                g = (by_edge[e, d] + by_edge[12 + e // 4, d] / 4) / 8
                gradient[hexes[h, EDGES[e, 0]], d] -= g
                gradient[hexes[h, EDGES[e, 1]], d] += g
    return total / 8


@njit(cache=True)
def _spring_energy(x, springs, gradient):
    total = 0.0
    for s in range(len(springs.goal)):
        r = [-springs.goal[s, 0], -springs.goal[s, 1], -springs.goal[s, 2]]
        for k in range(4):
            share = springs.share[s, k]
            if share != 0:
                for d in range(3):
                    r[d] += share * x[springs.vertex[s, k], d]
        n = springs.direction[s]
        off = r[0] * n[0] + r[1] * n[1] + r[2] * n[2]
        along, every = springs.along[s], springs.every[s]
        total += along * off * off + every * (r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
        for k in range(4):
            share = 2 * springs.share[s, k]
            if share != 0:
                for d in range(3):
                    gradient[springs.vertex[s, k], d] += share * (along * off * n[d] + every * r[d])
    return total
