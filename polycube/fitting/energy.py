"""Energy of a hex mesh with its gradient: shape, soft minimum of the scaled Jacobian, springs.

Nine frames per hex: its eight corners and the mean of its edges in each direction (the centre frame
of VTK's scaled Jacobian). With a, b, c the edges of the frame, D = det [a b c], and d, S the
determinant and squared norm of the edges divided by their wanted lengths,

    shape   S / (3 chi^2/3) + barrel (d^2 + 1) / (2 chi),   chi = (d + sqrt(eps^2 + d^2)) / 2
    jacobian  exp(-beta (D / |a||b||c| - offset)) / beta

summed over the frames and divided by 8 (Garanzha et al. 2021 for the shape term). The energy is
infinite if d is below `floor` in any frame, so valid hexes stay valid.
"""

from functools import partial
from typing import NamedTuple

import numpy as np
from numba import njit

from polycube.fitting.springs import Springs, spring_energy
from polycube.hexmesh.connectivity import EDGES
from polycube.hexmesh.scaled_jacobian import FRAME_EDGES, FRAME_SIGNS, load_edges
from polycube.numerics.fast_math import FAST, exponential, inverse_cube_root
from polycube.numerics.threads import parts, side_by_side
from polycube.numerics.vectors import cross, dot

_DIRECTION = np.vstack([FRAME_EDGES[:8] // 4, [0, 1, 2]])  # direction of each edge of each frame
_TINY = 1e-30
_LEAST_CHI = 1e-12
LANES = 32  # hexes evaluated together
LEAST = 3000  # smallest number of hexes for a thread
EPS = 1e-3  # regularization of d for valid hexes
FLOOR = 1e-3  # largest bound of the determinants in a descent


class Terms(NamedTuple):
    """Weights of the two hex terms, and the bound of the determinants."""

    shape: float = 1.0
    eps: float = EPS
    barrel: float = 0.1
    jacobian: float = 0.0
    beta: float = 1.0
    offset: float = 0.0
    floor: float = -np.inf


def energy(
    x: np.ndarray, hexes: np.ndarray, lengths: np.ndarray, terms: Terms, springs: Springs
) -> tuple[float, np.ndarray]:
    """Energy and gradient (V, 3); below the floor the energy is infinite and the gradient
    undefined.

    x : (V, 3), lengths : (H, 3) wanted edge lengths along xi, eta, zeta
    """
    terms = Terms(*map(float, terms))
    hexes = np.broadcast_to(hexes, hexes.shape)  # read-only, for which alone the code is compiled
    cuts = parts(len(hexes), LEAST)
    gradients = np.zeros((len(cuts), *x.shape))
    values = side_by_side(
        [
            partial(_hex_energy, x, hexes[cut], lengths[cut], terms, gradient)
            for cut, gradient in zip(cuts, gradients, strict=True)
        ]
    )
    value, gradient = sum(values), gradients.sum(axis=0)
    if np.isfinite(value):
        value += spring_energy(x, springs, gradient)
    return value, gradient


def bound(least: float) -> float:
    """Bound of the determinants in a descent from valid hexes with the smallest one `least`."""
    return min(0.5 * least, FLOOR)


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def least_determinant(x: np.ndarray, hexes: np.ndarray, lengths: np.ndarray) -> float:
    """Smallest d of all frames."""
    least = np.inf
    edge = np.zeros((15, 3))
    for h in range(len(hexes)):
        load_edges(x, hexes[h], edge)
        scale = 1 / (lengths[h, 0] * lengths[h, 1] * lengths[h, 2])
        for f in range(9):
            a, b, c = edge[FRAME_EDGES[f, 0]], edge[FRAME_EDGES[f, 1]], edge[FRAME_EDGES[f, 2]]
            least = min(least, FRAME_SIGNS[f] * dot(a, cross(b, c)) * scale)
    return least


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _hex_energy(
    x: np.ndarray, hexes: np.ndarray, lengths: np.ndarray, terms: Terms, gradient: np.ndarray
) -> float:
    """Sum over hexes; adds to the gradient through the gradient by edges.

    LANES hexes are evaluated together, so that the loops over them are vectorised.
    """
    total = 0.0
    corner, weight = np.empty((24, LANES)), np.empty((4, LANES))
    edge, by_edge, out = np.empty((45, LANES)), np.empty((45, LANES)), np.empty((6, LANES))
    least = np.empty(LANES)
    for start in range(0, len(hexes), LANES):
        batch = hexes[start : start + LANES]
        _gather(x, batch, lengths[start : start + LANES], corner, weight)
        _edges(corner, edge)
        by_edge[:] = 0.0
        least[:] = np.inf
        for f in range(9):
            i, j, k = 3 * FRAME_EDGES[f, 0], 3 * FRAME_EDGES[f, 1], 3 * FRAME_EDGES[f, 2]
            _frame(edge, weight, f, terms, out)
            _add_cross(by_edge, edge, i, j, k, out, 2)
            _add_cross(by_edge, edge, j, k, i, out, 3)
            _add_cross(by_edge, edge, k, i, j, out, 4)
            for at in range(LANES):
                least[at] = min(least[at], out[5, at])
            for at in range(len(batch)):
                total += out[0, at]
        for at in range(len(batch)):
            if least[at] < terms.floor:
                return np.inf
        _scatter(by_edge, batch, corner, gradient)
    return total / 8


@njit(cache=True, fastmath=FAST, error_model="numpy", inline="always")
def _gather(
    x: np.ndarray, hexes: np.ndarray, lengths: np.ndarray, corner: np.ndarray, weight: np.ndarray
) -> None:
    """Corners of hexes, and weights of edges and determinants; a smaller batch is padded."""
    for at in range(LANES):
        h = min(at, len(hexes) - 1)
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
def _edges(corner: np.ndarray, edge: np.ndarray) -> None:
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
def _frame(edge: np.ndarray, weight: np.ndarray, f: int, terms: Terms, out: np.ndarray) -> None:
    """Values of a frame.

    `out` receives the value, the derivative with respect to the determinant, the factors of a, b, c
    in the gradients with respect to a, b, c, and d.
    """
    i, j, k = 3 * FRAME_EDGES[f, 0], 3 * FRAME_EDGES[f, 1], 3 * FRAME_EDGES[f, 2]
    p, q, r = _DIRECTION[f]
    sign = FRAME_SIGNS[f]
    for at in range(LANES):
        a = (edge[i, at], edge[i + 1, at], edge[i + 2, at])
        b = (edge[j, at], edge[j + 1, at], edge[j + 2, at])
        c = (edge[k, at], edge[k + 1, at], edge[k + 2, at])
        det = sign * dot(a, cross(b, c))
        a2, b2, c2 = dot(a, a) + _TINY, dot(b, b) + _TINY, dot(c, c) + _TINY
        wa, wb, wc, scale = weight[p, at], weight[q, at], weight[r, at], weight[3, at]
        d = det * scale
        norm = a2 * wa + b2 * wb + c2 * wc
        root = np.sqrt(terms.eps * terms.eps + d * d)
        third = inverse_cube_root(max(0.5 * (d + root), _LEAST_CHI))
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
def _add_cross(
    by_edge: np.ndarray, edge: np.ndarray, i: int, j: int, k: int, out: np.ndarray, row: int
) -> None:
    """Add the gradient with respect to the edge in row i: factor times a, plus b x c."""
    for at in range(LANES):
        b = (edge[j, at], edge[j + 1, at], edge[j + 2, at])
        c = (edge[k, at], edge[k + 1, at], edge[k + 2, at])
        bc = cross(b, c)
        by_edge[i, at] += out[row, at] * edge[i, at] + out[1, at] * bc[0]
        by_edge[i + 1, at] += out[row, at] * edge[i + 1, at] + out[1, at] * bc[1]
        by_edge[i + 2, at] += out[row, at] * edge[i + 2, at] + out[1, at] * bc[2]


@njit(cache=True, fastmath=FAST, error_model="numpy", inline="always")
def _scatter(
    by_edge: np.ndarray, hexes: np.ndarray, corner: np.ndarray, gradient: np.ndarray
) -> None:
    """Add the gradients with respect to edges to those of the vertices, through the corners."""
    corner[:] = 0.0
    for e in range(12):
        p, q = 3 * EDGES[e, 0], 3 * EDGES[e, 1]
        for d in range(3):
            for at in range(LANES):
                g = (by_edge[3 * e + d, at] + by_edge[36 + e // 4 * 3 + d, at] / 4) / 8
                corner[p + d, at] -= g
                corner[q + d, at] += g
    for at in range(len(hexes)):
        for k in range(8):
            for d in range(3):
                gradient[hexes[at, k], d] += corner[3 * k + d, at]
