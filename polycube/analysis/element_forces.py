"""Compiled elastic forces of tricubic elements: sums are factorised.

The net of an element is contracted along z, then y, then x; the adjoint uses the reverse order.
Each number of an element has a row with a lane for each of `LANES` elements, so that the compiled
loops are vectorised. The derivatives of the parameters by the coordinates are given.
"""

from functools import partial
from typing import NamedTuple

import numpy as np
from numba import njit

from polycube.analysis.problem import Material
from polycube.numerics.fast_math import FAST
from polycube.numerics.threads import parts, side_by_side
from polycube.spline.bernstein import bernstein, derivative, gauss

LANES = 16  # elements in a batch
LEAST = 4  # smallest number of batches for a thread
XX, YX, ZX, XY, YY, ZY, XZ, YZ, ZZ = range(0, 9 * LANES, LANES)  # rows of a matrix


class Sums(NamedTuple):
    """Rows of sums at the nodes of elements, such that no two threads change the same row."""

    rows: np.ndarray  # (E, 64); the first thread with a node has the row of the node
    further: list[np.ndarray]  # nodes of the rows after those of all nodes, of each other thread
    batches: list[slice]  # of each thread

    @classmethod
    def at(cls, nodes: np.ndarray, size: int) -> "Sums":
        """The rows for nodes (E, 64) of elements, of a number of nodes."""
        has, rows, further, end = np.zeros(size, bool), np.empty_like(nodes), [], size
        batches = parts(-(-len(nodes) // LANES), LEAST)
        for part in batches:
            own, row, before = slice(part.start * LANES, part.stop * LANES), np.arange(size), has
            has = np.zeros(size, bool)
            has[nodes[own]] = True
            further.append(np.flatnonzero(has & before))
            row[further[-1]] = end + np.arange(len(further[-1]))
            rows[own], has, end = row[nodes[own]], has | before, end + len(further[-1])
        return cls(rows, further, batches)


def elastic_forces(
    place: np.ndarray,
    nodes: np.ndarray,
    sums: Sums,
    displacement: np.ndarray,
    n_gauss: int,
    solid: Material,
    to_bezier: np.ndarray,
    stress: np.ndarray | None = None,
) -> np.ndarray:
    """(B, 3) forces K u of the functions of the nodes.

    place : (ceil(E / LANES), n^3, 9 LANES) derivatives da_k/dx_i at the Gauss points of a batch,
        times the square root of the volume, with a row of lanes for every i of every k
    displacement : (B, 3) coefficients, in the precision of `place`.  nodes : (E, 64)
    sums : those of the nodes
    to_bezier : (4, 4) Bezier coefficients on a line from these
    stress : (E, n^3, 6) is filled with stresses times the square root of the volume, in 32 bits
    """
    size, line = len(displacement), gauss(n_gauss)[0]
    moduli = np.zeros((len(nodes), 2)) + np.column_stack([solid.shear, solid.lame])
    tables = displacement, bernstein(line) @ to_bezier, derivative(line) @ to_bezier, moduli
    u, values, slopes, moduli = (np.ascontiguousarray(table, place.dtype) for table in tables)
    kept = np.empty((0, n_gauss**3, 6), np.float32) if stress is None else stress
    found = np.zeros((size + sum(map(len, sums.further)), 3), place.dtype)
    given = partial(_forces, place, nodes, sums.rows, found, u, values, slopes, moduli, kept)
    side_by_side([partial(given, part.start, part.stop) for part in sums.batches])
    for nodes in sums.further:
        found[nodes] += found[size : (size := size + len(nodes))]
    return found[: len(displacement)]


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _forces(
    place: np.ndarray,
    nodes: np.ndarray,
    rows: np.ndarray,
    found: np.ndarray,
    displacement: np.ndarray,
    values: np.ndarray,
    slopes: np.ndarray,
    moduli: np.ndarray,
    stress: np.ndarray,
    first: int,
    last: int,
) -> None:
    """Add the forces of some batches of elements to rows; values, slopes (n, 4) on a line."""
    n, kind = len(values), displacement.dtype
    of_lanes, kept = np.empty((2, LANES), kind), np.empty((n * n, 6 * LANES), kind)
    net, slope = np.empty(192 * LANES, kind), np.empty((n * n, 3, 3 * LANES), kind)
    by_net, flat = np.empty_like(net), slope.reshape(n * n, -1)
    planes, lines = np.empty((2, 48 * LANES), kind), np.empty((3, 12 * LANES), kind)
    for batch in range(first, last):
        start = batch * LANES
        many = min(LANES, len(nodes) - start)
        _gather(displacement, nodes, start, net)
        for at in range(LANES):
            of_lanes[0, at], of_lanes[1, at] = moduli[min(start + at, len(nodes) - 1)]
        by_net[:] = 0
        for k in range(n):
            _tangents(net, values, slopes, k, planes, lines, slope)
            for s in range(n * n):
                _resist(place[batch, n * n * k + s], flat[s], of_lanes[0], of_lanes[1], kept[s])
            _add_back(slope, values, slopes, k, planes, lines, by_net)
            for at in range(many if len(stress) else 0):
                for s in range(n * n):
                    for c in range(6):
                        stress[start + at, n * n * k + s, c] = kept[s, c * LANES + at]
        for at in range(many):
            for r in range(64):
                for d in range(3):
                    found[rows[start + at, r], d] += by_net[(3 * r + d) * LANES + at]


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _resist(
    p: np.ndarray, u: np.ndarray, shear: np.ndarray, lame: np.ndarray, stress: np.ndarray
) -> None:
    """Replace the derivatives of u at a point by those of the energy with respect to them.

    p, u : (9 LANES,) derivatives da/dx and du/da.  shear, lame : (LANES,) moduli
    stress : (6 LANES,) is filled with xx yy zz yz zx xy
    """
    for x in range(LANES):
        y, z = x + YX, x + ZX
        mu = shear[x]
        xx = u[x] * p[x] + u[x + XY] * p[x + XY] + u[x + XZ] * p[x + XZ]
        yy = u[y] * p[y] + u[y + XY] * p[y + XY] + u[y + XZ] * p[y + XZ]
        zz = u[z] * p[z] + u[z + XY] * p[z + XY] + u[z + XZ] * p[z + XZ]
        yz = u[y] * p[z] + u[y + XY] * p[z + XY] + u[y + XZ] * p[z + XZ]
        zx = u[z] * p[x] + u[z + XY] * p[x + XY] + u[z + XZ] * p[x + XZ]
        xy = u[x] * p[y] + u[x + XY] * p[y + XY] + u[x + XZ] * p[y + XZ]
        yz = mu * (yz + u[z] * p[y] + u[z + XY] * p[y + XY] + u[z + XZ] * p[y + XZ])
        zx = mu * (zx + u[x] * p[z] + u[x + XY] * p[z + XY] + u[x + XZ] * p[z + XZ])
        xy = mu * (xy + u[y] * p[x] + u[y + XY] * p[x + XY] + u[y + XZ] * p[x + XZ])
        spread = lame[x] * (xx + yy + zz)
        xx, yy, zz = mu * (xx + xx) + spread, mu * (yy + yy) + spread, mu * (zz + zz) + spread
        stress[x], stress[y], stress[z] = xx, yy, zz
        stress[x + XY], stress[y + XY], stress[z + XY] = yz, zx, xy
        for k in (0, XY, XZ):
            a, b, c = p[x + k], p[y + k], p[z + k]
            u[x + k] = xx * a + xy * b + zx * c
            u[y + k] = xy * a + yy * b + yz * c
            u[z + k] = zx * a + yz * b + zz * c


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
