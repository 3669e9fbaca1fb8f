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

from polycube.geometry.hexes import CORNERS, EDGES, PLACES

_EDGE_ENDS = EDGES.reshape(3, 4, 2)
# direction of the three edges at each corner
_DIRECTION = (PLACES[CORNERS[:, 1:]] != PLACES[CORNERS[:, :1]]).argmax(axis=2)


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


@njit(cache=True)
def least_determinant(x: np.ndarray, hexes: np.ndarray, lengths: np.ndarray) -> float:
    """Smallest d of all frames."""
    least = np.inf
    for h in range(len(hexes)):
        scale = 1 / (lengths[h, 0] * lengths[h, 1] * lengths[h, 2])
        for f in range(9):
            a, b, c = _edges(x, hexes[h], f)
            least = min(least, _dot(a, _cross(b, c)) * scale)
    return least


@njit(cache=True)
def scaled_jacobian(x: np.ndarray, hexes: np.ndarray) -> np.ndarray:
    """(H,) smallest scaled Jacobian over corners and centre; -1 where an edge has no length."""
    result = np.ones(len(hexes))
    for h in range(len(hexes)):
        for f in range(9):
            a, b, c = _edges(x, hexes[h], f)
            size = np.sqrt(_dot(a, a)) * np.sqrt(_dot(b, b)) * np.sqrt(_dot(c, c))
            value = _dot(a, _cross(b, c)) / size if size > 0 else -1.0
            result[h] = min(result[h], max(value, -1.0))
    return result


@njit(cache=True, inline="always")
def _cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@njit(cache=True, inline="always")
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def _minus(x, i, j):
    return (x[i, 0] - x[j, 0], x[i, 1] - x[j, 1], x[i, 2] - x[j, 2])


@njit(cache=True)
def _mean_edge(x, hex, d):
    a, b, c = 0.0, 0.0, 0.0
    for k in range(4):
        e = _minus(x, hex[_EDGE_ENDS[d, k, 1]], hex[_EDGE_ENDS[d, k, 0]])
        a, b, c = a + e[0], b + e[1], c + e[2]
    return (a / 4, b / 4, c / 4)


@njit(cache=True)
def _edges(x, hex, frame):
    """The three edges of a corner frame (0..7) or of the centre (8)."""
    if frame == 8:
        return _mean_edge(x, hex, 0), _mean_edge(x, hex, 1), _mean_edge(x, hex, 2)
    o = hex[CORNERS[frame, 0]]
    return (
        _minus(x, hex[CORNERS[frame, 1]], o),
        _minus(x, hex[CORNERS[frame, 2]], o),
        _minus(x, hex[CORNERS[frame, 3]], o),
    )


@njit(cache=True)
def _frame_energy(a2, b2, c2, det, wa, wb, wc, terms):
    """Value, derivative by det, and factors of a, b, c in the gradients by a, b, c."""
    value, by_det, fa, fb, fc = 0.0, 0.0, 0.0, 0.0, 0.0
    if terms.shape > 0:
        scale = np.sqrt(wa * wb * wc)
        d = det * scale
        norm = a2 * wa + b2 * wb + c2 * wc
        root = np.sqrt(terms.eps * terms.eps + d * d)
        chi = max(0.5 * (d + root), 1e-12)
        slope = 0.5 * (1 + d / root)
        third = np.cbrt(chi)
        power = 1 / (third * third)
        spread = (d * d + 1) / (2 * chi)
        value += terms.shape * (norm * power / 3 + terms.barrel * spread)
        by_chi = -2 / 9 * norm * power - terms.barrel * spread
        by_det += terms.shape * scale * (by_chi * slope + terms.barrel * d) / chi
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


@njit(cache=True)
def _hex_energy(x, hexes, lengths, terms, gradient):
    total = 0.0
    tiny = 1e-30
    for h in range(len(hexes)):
        hex = hexes[h]
        w = (lengths[h, 0] ** -2, lengths[h, 1] ** -2, lengths[h, 2] ** -2)
        scale = np.sqrt(w[0] * w[1] * w[2])
        for f in range(9):
            a, b, c = _edges(x, hex, f)
            bc, ca, ab = _cross(b, c), _cross(c, a), _cross(a, b)
            det = _dot(a, bc)
            if det * scale < terms.floor:
                return np.inf
            k = (0, 1, 2) if f == 8 else (_DIRECTION[f, 0], _DIRECTION[f, 1], _DIRECTION[f, 2])
            value, by_det, fa, fb, fc = _frame_energy(
                _dot(a, a) + tiny, _dot(b, b) + tiny, _dot(c, c) + tiny, det,
                w[k[0]], w[k[1]], w[k[2]], terms,
            )  # fmt: skip
            total += value / 8
            for d in range(3):
                ga = (fa * a[d] + by_det * bc[d]) / 8
                gb = (fb * b[d] + by_det * ca[d]) / 8
                gc = (fc * c[d] + by_det * ab[d]) / 8
                if f < 8:
                    gradient[hex[CORNERS[f, 0]], d] -= ga + gb + gc
                    gradient[hex[CORNERS[f, 1]], d] += ga
                    gradient[hex[CORNERS[f, 2]], d] += gb
                    gradient[hex[CORNERS[f, 3]], d] += gc
                else:
                    for e in range(4):
                        for j, g in ((0, ga), (1, gb), (2, gc)):
                            gradient[hex[_EDGE_ENDS[j, e, 0]], d] -= g / 4
                            gradient[hex[_EDGE_ENDS[j, e, 1]], d] += g / 4
    return total


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
