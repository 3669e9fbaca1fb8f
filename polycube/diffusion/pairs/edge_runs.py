"""Straight edges of a lattice, with the space that is available to round them.

At an edge, one of the four boxes around it differs from the other three: it is full at a convex
edge and empty at a concave one. Both are rounded within this odd box and similar boxes next to it.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from polycube.types import PerAxis


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
        edge_numbers, edge_lengths = _scan(full, *ends)
        numbers.append(np.column_stack([np.full(len(edge_numbers), axis), edge_numbers]))
        lengths.append(edge_lengths)
    n, x = np.concatenate(numbers), np.concatenate(lengths)
    return EdgeRuns(
        axis=n[:, 0],
        line=n[:, 1:3],
        span=n[:, 3:5],
        outward=n[:, 5:7],
        is_convex=n[:, 7] == 1,
        is_free=n[:, 8:10] == 1,
        at=x[:, 0:2],
        ends=x[:, 2:4],
        side=x[:, 4:6],
        beyond=x[:, 6:8],
        after=x[:, 8:10],
        depth=x[:, 10],
    )


@njit(cache=True)
def _scan(
    full: np.ndarray, x: np.ndarray, y: np.ndarray, z: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Edges along the last axis of padded boxes: (E, 9) numbers and (E, 11) lengths."""
    n_x, n_y, n_z = full.shape
    across = full.transpose(1, 0, 2)
    numbers, lengths = np.zeros((n_x * n_y * n_z, 9), np.int64), np.zeros((n_x * n_y * n_z, 11))
    found = 0
    for i in range(n_x - 1):
        for j in range(n_y - 1):
            last = 1
            while last < n_z:
                first, odd = last, _odd(full, i, j, last)
                last = first + 1
                while last < n_z and _odd(full, i, j, last) == odd:
                    last += 1
                if odd < 0:
                    continue
                a, b, kind = odd // 4, odd // 2 % 2, odd % 2
                run = (first, last)
                side_u, n_u = _side(full, (i + a, 2 * a - 1), (j + b, j + 1 - b), run, x)
                side_v, n_v = _side(across, (j + b, 2 * b - 1), (i + a, i + 1 - a), run, y)
                deep_v = _deep(full, (i + a, 2 * a - 1, n_u), (j + b, 2 * b - 1), run, y)
                deep_u = _deep(across, (j + b, 2 * b - 1, n_v), (i + a, 2 * a - 1), run, x)
                numbers[found, :5] = i, j, first - 1, last - 1, 1 - 2 * a
                numbers[found, 5:7] = 1 - 2 * b, kind
                numbers[found, 7] = _are_equal(full, i, j, first - 1)
                numbers[found, 8] = _are_equal(full, i, j, last)
                lengths[found, :4] = x[i + 1], y[j + 1], z[first], z[last]
                lengths[found, 4:6] = side_u, side_v
                lengths[found, 6] = x[i + 2 - a] - x[i + 1 - a]
                lengths[found, 7] = y[j + 2 - b] - y[j + 1 - b]
                lengths[found, 8] = z[first] - z[first - 1]
                lengths[found, 9] = z[last + 1] - z[last]
                lengths[found, 10] = min(deep_u, deep_v)
                found += 1
    return numbers[:found], lengths[:found]


@njit(cache=True)
def _odd(full: np.ndarray, i: int, j: int, k: int) -> int:
    """The box that differs from the three others: 4 a + 2 b + full; -1 if there is none."""
    n_full = full[i, j, k] + full[i, j + 1, k] + full[i + 1, j, k] + full[i + 1, j + 1, k]
    if n_full != 1 and n_full != 3:
        return -1
    kind = 1 if n_full == 1 else 0
    for a in range(2):
        for b in range(2):
            if full[i + a, j + b, k] == kind:
                odd = 4 * a + 2 * b + kind
    return odd


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
