"""Fillets and chamfers of lattice edges as a map of space, exact on the sides of an edge.

For an edge of radius r, let y be the distances from the centre of the arc divided by r: the sides
of the edge are |y|_inf = 1, the edge is (1, 1). The square ring |y|_inf = m is mapped to the ring
|y|_2 = m of a fillet, or |y|_1 = m of a chamfer:

    y -> y m / |y|_p

Four edges of a square section with the largest radius thus form a circle. Outside, the map fades
out between a third of the distance to the next knot and that knot; inside, up to the depth of the
next feature; along the edge, beyond its ends. The planes of other knots are therefore unchanged.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from polycube.types import PerAxis

FILLET, CHAMFER = 2, 1  # the norm p
EXTENT = 1 / 3  # of the distance to the next knot: extent of the rings
DEEPEST = 0.6  # of a radius: largest depth of the next feature inside


class EdgeRuns(NamedTuple):
    """Edges along an axis, each from one end to the other; (u, v) are the next two axes."""

    axis: np.ndarray  # (E,) 0..2
    line: np.ndarray  # (E, 2) knot numbers in u and v
    span: np.ndarray  # (E, 2) knot numbers of their ends along the axis
    outward: np.ndarray  # (E, 2) +1 or -1: direction away from the odd box, in u and v
    is_convex: np.ndarray  # (E,)
    is_free: np.ndarray  # (E, 2) whether the four boxes beyond each end are equal
    at: np.ndarray  # (E, 2) coordinates u and v
    ends: np.ndarray  # (E, 2) coordinates of the ends along the axis
    side: np.ndarray  # (E, 2) lengths of the adjacent flat sides
    beyond: np.ndarray  # (E, 2) widths of the next slabs outwards in u and v
    after: np.ndarray  # (E, 2) widths of the next slabs beyond the ends
    depth: np.ndarray  # (E,) depth into the odd box without other features


def edge_runs(occupancy: np.ndarray, knots: PerAxis) -> EdgeRuns:
    """All edges of a manifold union of boxes (X, Y, Z)."""
    far = sum(each[-1] - each[0] for each in knots)
    numbers, lengths = [], []
    for axis in range(3):
        order = [(axis + 1) % 3, (axis + 2) % 3, axis]
        full = np.ascontiguousarray(np.pad(occupancy, 1).transpose(order))
        ends = [np.concatenate([[k[0] - far], k, [k[-1] + far]]) for k in (knots[a] for a in order)]
        across = np.ascontiguousarray(full.transpose(1, 0, 2))
        edge_numbers, edge_lengths = _scan(full, across, *ends)
        numbers.append(np.column_stack([np.full(len(edge_numbers), axis), edge_numbers]))
        lengths.append(edge_lengths)
    n, x = np.concatenate(numbers), np.concatenate(lengths)
    axes, line, span, outward, is_convex, is_free = np.split(n, [1, 3, 5, 7, 8], axis=1)
    at, along, side, beyond, after, depth = np.split(x, [2, 4, 6, 8, 10], axis=1)
    own = axes.ravel(), line, span, outward, is_convex.ravel() == 1, is_free == 1
    return EdgeRuns(*own, at, along, side, beyond, after, depth.ravel())


@njit(cache=True)
def _scan(
    full: np.ndarray, across: np.ndarray, x: np.ndarray, y: np.ndarray, z: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Edges along z of padded boxes, also with x and y swapped: (E, 9) numbers, (E, 11) lengths."""
    n_x, n_y, n_z = full.shape
    numbers, lengths = np.zeros((n_x * n_y * n_z, 9), np.int64), np.zeros((n_x * n_y * n_z, 11))
    found = 0
    for i in range(n_x - 1):
        for j in range(n_y - 1):
            for first in range(1, n_z):
                odd, last = _odd(full, i, j, first), first + 1
                if odd < 0 or odd == _odd(full, i, j, first - 1):
                    continue
                while last < n_z and _odd(full, i, j, last) == odd:
                    last += 1
                a, b, kind = odd // 4, odd // 2 % 2, odd % 2
                run = (first, last)
                side_u, n_u = _side(full, (i + a, 2 * a - 1), (j + b, j + 1 - b), run, x)
                side_v, n_v = _side(across, (j + b, 2 * b - 1), (i + a, i + 1 - a), run, y)
                deep_v = _deep(full, (i + a, 2 * a - 1, n_u), (j + b, 2 * b - 1), run, y)
                deep_u = _deep(across, (j + b, 2 * b - 1, n_v), (i + a, 2 * a - 1), run, x)
                free = int(_are_equal(full, i, j, first - 1)), int(_are_equal(full, i, j, last))
                place = (i, j, first - 1, last - 1, 1 - 2 * a, 1 - 2 * b, kind)
                for k, number in enumerate(place + free):
                    numbers[found, k] = number
                beyond = x[i + 2 - a] - x[i + 1 - a], y[j + 2 - b] - y[j + 1 - b]
                after = z[first] - z[first - 1], z[last + 1] - z[last], min(deep_u, deep_v)
                at = (x[i + 1], y[j + 1], z[first], z[last], side_u, side_v)
                for k, length in enumerate(at + beyond + after):
                    lengths[found, k] = length
                found += 1
    return numbers[:found], lengths[:found]


@njit(cache=True)
def _odd(full: np.ndarray, i: int, j: int, k: int) -> int:
    """The box that differs from the three others: 4 a + 2 b + full; -1 if there is none."""
    n_full = full[i, j, k] + full[i, j + 1, k] + full[i + 1, j, k] + full[i + 1, j + 1, k]
    kind = 1 if n_full == 1 else 0
    for a in range(2):
        for b in range(2):
            if n_full % 2 == 1 and full[i + a, j + b, k] == kind:
                return 4 * a + 2 * b + kind
    return -1


@njit(cache=True)
def _are_equal(full: np.ndarray, i: int, j: int, k: int) -> bool:
    n_full = full[i, j, k] + full[i, j + 1, k] + full[i + 1, j, k] + full[i + 1, j + 1, k]
    return n_full == 0 or n_full == 4


@njit(cache=True)
def _side(
    full: np.ndarray,
    inwards: tuple[int, int],
    rows: tuple[int, int],
    run: tuple[int, int],
    x: np.ndarray,
) -> tuple[float, int]:
    """Length of the flat side from the edge inwards, and its number of boxes."""
    (at, step), (inside, outside) = inwards, rows
    width, n, kind = 0.0, 0, full[at, inside, run[0]]
    while 0 <= at < full.shape[0]:
        for k in range(run[0], run[1]):
            if full[at, inside, k] != kind or full[at, outside, k] == kind:
                return width, n
        width += x[at + 1] - x[at]
        n += 1
        at += step
    return width, n


@njit(cache=True)
def _deep(
    full: np.ndarray,
    side: tuple[int, int, int],
    inwards: tuple[int, int],
    run: tuple[int, int],
    y: np.ndarray,
) -> float:
    """Depth below a flat side of n boxes to which all boxes equal those at the side."""
    (first, along, n), (at, step) = side, inwards
    depth, kind = 0.0, full[first, at, run[0]]
    while 0 <= at < full.shape[1]:
        for m in range(n):
            for k in range(run[0], run[1]):
                if full[first + m * along, at, k] != kind:
                    return depth
        depth += y[at + 1] - y[at]
        at += step
    return depth


class Fillets(NamedTuple):
    """Edges that are rounded."""

    edges: EdgeRuns
    radius: np.ndarray  # (E,) 0: sharp
    norm: np.ndarray  # (E,) FILLET or CHAMFER


def largest_radii(edges: EdgeRuns) -> np.ndarray:
    """(E,) radius of each edge at which it meets its neighbours in the middle of a side."""
    return np.minimum(edges.side.min(axis=1) / 2, edges.depth / (1 - DEEPEST))


def rounded(vertices: np.ndarray, fillets: Fillets) -> np.ndarray:
    """(V, 3) points of a lattice after rounding its edges.

    The axis with the largest roundings is last, so that a chamfered hole or boss becomes round.
    """
    edges, radius, _ = fillets
    x = vertices.copy()
    for axis in np.argsort([radius[edges.axis == axis].sum() for axis in range(3)], kind="stable"):
        used = (edges.axis == axis) & (radius > 0)
        if used.any():
            _move_along(int(axis), x, fillets, used)
    return x


def _move_along(axis: int, x: np.ndarray, fillets: Fillets, used: np.ndarray) -> None:
    """Move the points x by the used edges, all along one axis."""
    edges, radius = fillets.edges, fillets.radius[used]
    after = np.minimum(edges.after[used], np.where(edges.is_free[used], np.inf, radius[:, None]))
    inner = np.maximum(1 - edges.depth[used] / radius, 0)
    sizes = np.column_stack([radius, fillets.norm[used], inner])
    order = np.array([(axis + 1) % 3, (axis + 2) % 3, axis])
    places = (edges.at[used], edges.outward[used], edges.ends[used])
    _move(x, order, *places, edges.beyond[used], after, sizes)


@njit(cache=True)
def _move(
    x: np.ndarray,
    order: np.ndarray,
    at: np.ndarray,
    outward: np.ndarray,
    ends: np.ndarray,
    beyond: np.ndarray,
    after: np.ndarray,
    sizes: np.ndarray,
) -> None:
    """Sum of the displacements of each point by all edges along one axis."""
    for v in range(len(x)):
        u, w, along = x[v, order[0]], x[v, order[1]], x[v, order[2]]
        for e in range(len(at)):
            radius, norm, inner = sizes[e]
            off = max((ends[e, 0] - along) / after[e, 0], (along - ends[e, 1]) / after[e, 1])
            y_u = 1 + outward[e, 0] * (u - at[e, 0]) / radius
            y_w = 1 + outward[e, 1] * (w - at[e, 1]) / radius
            if off >= 1 or y_u <= 0 or y_w <= 0:
                continue
            m = max(y_u, y_w)
            away = radius * max((y_u - 1) / beyond[e, 0], (y_w - 1) / beyond[e, 1])
            if away >= 1 or m <= inner:
                continue
            length = np.sqrt(y_u**2 + y_w**2) if norm == 2 else y_u + y_w
            share = min(1.0, 1 - off) * min(1.0, (1 - away) / (1 - EXTENT))
            if m < 1:
                share *= (1 - inner / m) / (1 - inner)
            step = share * radius * (m / length - 1)
            x[v, order[0]] += outward[e, 0] * step * y_u
            x[v, order[1]] += outward[e, 1] * step * y_w
