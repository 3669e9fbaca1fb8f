"""det J of tricubic elements on a grid: values, minima, and squared shortfall."""

from functools import partial

import numpy as np
from numba import njit

from polycube.numerics.fast_math import FAST
from polycube.numerics.threads import parts, side_by_side
from polycube.spline.bernstein import bernstein, derivative
from polycube.spline.element_tangents import LANES, add_back, buffers, gather, tangents

LEAST = 256  # smallest number of elements for a thread


def detj(points: np.ndarray, nodes: np.ndarray, line: np.ndarray) -> np.ndarray:
    """(E, n^3) det J of elements with Bezier points[nodes] on the grid line x line x line.

    points : (B, 3).  nodes : (E, 64).  line : (n,) parameters
    """
    tables = bernstein(line), derivative(line)
    work = [partial(_values, points, nodes[p], *tables) for p in parts(len(nodes), LEAST)]
    return np.concatenate(side_by_side(work))


def least_detj(
    points: np.ndarray, nodes: np.ndarray, line: np.ndarray, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(E,) smallest value of each element on the grid, and weighted sums (E,) of the values.

    weights : (n,) weights of a quadrature rule on the line, used as a tensor product
    """
    tables = bernstein(line), derivative(line)
    work = [partial(_least, points, nodes[p], *tables, weights) for p in parts(len(nodes), LEAST)]
    least, volume = zip(*side_by_side(work), strict=True)
    return np.concatenate(least), np.concatenate(volume)


def squared_shortfall(
    points: np.ndarray, nodes: np.ndarray, line: np.ndarray, unit: np.ndarray, wanted: float
) -> tuple[float, np.ndarray]:
    """Sum of max(wanted - det J / unit, 0)^2 over elements and grid, and its gradient (B, 3).

    unit : (E,) scale of each element

    It runs on the calling thread and releases the global interpreter lock.
    """
    return _shortfall(points, nodes, bernstein(line), derivative(line), unit, wanted)


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _determinants(tangents: np.ndarray, out: np.ndarray) -> None:
    """Determinants (n^2, LANES) of tangents (n^2, 3, 3 LANES)."""
    lanes = out.shape[1]
    for s in range(len(out)):
        a, b, c, det = tangents[s, 0], tangents[s, 1], tangents[s, 2], out[s]
        for x in range(lanes):
            y, z = lanes + x, 2 * lanes + x
            det[x] = (
                a[x] * (b[y] * c[z] - b[z] * c[y])
                + a[y] * (b[z] * c[x] - b[x] * c[z])
                + a[z] * (b[x] * c[y] - b[y] * c[x])
            )


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _by_tangents(by_det: np.ndarray, tangents: np.ndarray, out: np.ndarray) -> None:
    """Derivatives by the tangents (n^2, 3, 3 LANES), from those by det J (n^2, LANES)."""
    lanes = by_det.shape[1]
    for s in range(len(by_det)):
        for k in range(3):
            b, c, slope = tangents[s, (k + 1) % 3], tangents[s, (k + 2) % 3], out[s, k]
            for x in range(lanes):
                y, z, by = lanes + x, 2 * lanes + x, by_det[s, x]
                slope[x] = by * (b[y] * c[z] - b[z] * c[y])
                slope[y] = by * (b[z] * c[x] - b[x] * c[z])
                slope[z] = by * (b[x] * c[y] - b[y] * c[x])


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _accumulate(det: np.ndarray, weights: np.ndarray, low: np.ndarray, sums: np.ndarray) -> None:
    """Update the minima and weighted sums (LANES,) with a plane (n^2, LANES)."""
    for s in range(len(det)):
        for at in range(len(low)):
            low[at] = min(low[at], det[s, at])
            sums[at] += weights[s] * det[s, at]


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _shortfall_of(det: np.ndarray, goal: np.ndarray, inverse: np.ndarray) -> float:
    """Squared shortfall of det J (n^2, LANES), which is replaced by the derivatives.

    goal, inverse : (LANES,) wanted value in units, and 1 / unit
    """
    total = 0.0
    for s in range(len(det)):
        row = det[s]
        for at in range(len(goal)):
            shortfall = max(goal[at] - row[at] * inverse[at], 0.0)
            total += shortfall * shortfall
            row[at] = -2 * shortfall * inverse[at]
    return total


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _values(
    points: np.ndarray, nodes: np.ndarray, values: np.ndarray, slopes: np.ndarray
) -> np.ndarray:
    """(E, n^3) values of det J."""
    n = len(values)
    found = np.empty((len(nodes), n**3))
    net, planes, lines, slope, det = buffers(n)
    for start in range(0, len(nodes), LANES):
        gather(points, nodes, start, net)
        for k in range(n):
            tangents(net, values, slopes, k, planes, lines, slope)
            _determinants(slope, det)
            for at in range(min(LANES, len(nodes) - start)):
                for s in range(n * n):
                    found[start + at, n * n * k + s] = det[s, at]
    return found


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _least(
    points: np.ndarray,
    nodes: np.ndarray,
    values: np.ndarray,
    slopes: np.ndarray,
    weights: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Smallest value (E,) and weighted sum (E,)."""
    n = len(values)
    least, total = np.empty(len(nodes)), np.empty(len(nodes))
    net, planes, lines, slope, det = buffers(n)
    square = np.outer(weights, weights).ravel()
    low, sums = np.empty(LANES), np.empty(LANES)
    for start in range(0, len(nodes), LANES):
        gather(points, nodes, start, net)
        low[:], sums[:] = np.inf, 0
        for k in range(n):
            tangents(net, values, slopes, k, planes, lines, slope)
            _determinants(slope, det)
            _accumulate(det, weights[k] * square, low, sums)
        for at in range(min(LANES, len(nodes) - start)):
            least[start + at], total[start + at] = low[at], sums[at]
    return least, total


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _shortfall(
    points: np.ndarray,
    nodes: np.ndarray,
    values: np.ndarray,
    slopes: np.ndarray,
    unit: np.ndarray,
    wanted: float,
) -> tuple[float, np.ndarray]:
    """The value, and its derivatives (B, 3) with respect to the points."""
    n, value = len(values), 0.0
    by_point = np.zeros(points.shape)
    net, planes, lines, slope, det = buffers(n)
    goal, inverse = np.full(LANES, wanted), np.zeros(LANES)
    by_net, by_tangents = np.empty(192 * LANES), np.empty((n * n, 3, 3 * LANES))
    for start in range(0, len(nodes), LANES):
        used = min(LANES, len(nodes) - start)
        gather(points, nodes, start, net)
        by_net[:], goal[used:] = 0, -np.inf
        inverse[:used] = 1 / unit[start : start + used]
        falls_short = False
        for k in range(n):
            tangents(net, values, slopes, k, planes, lines, slope)
            _determinants(slope, det)
            here = _shortfall_of(det, goal, inverse)
            if here == 0:
                continue
            value += here
            falls_short = True
            _by_tangents(det, slope, by_tangents)
            add_back(by_tangents, values, slopes, k, planes, lines, by_net)
        if not falls_short:
            continue
        for at in range(used):
            for r in range(64):
                for d in range(3):
                    by_point[nodes[start + at, r], d] += by_net[(3 * r + d) * LANES + at]
    return value, by_point
