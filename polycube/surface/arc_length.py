"""Arc lengths of the vertices of a path along a crease; compiled functions.

A crease is given by points (N, 3), the arc length at each point, and whether it is a loop. The last
point of a loop is its first point.
"""

import numpy as np
from numba import njit

from polycube.numerics.vectors import dot, minus

# weight of the deviation from the expected arc length, relative to a distance from the crease
EXPECTED = 0.2
BRANCH = 3.0  # length of a branch on either side, as a multiple of the distance from the crease
CLOSEST = 0.2  # smallest distance of neighbours along a crease, as a share of the even spacing


@njit(cache=True, nogil=True, error_model="numpy")
def _closest(
    points: np.ndarray, arc: np.ndarray, is_loop: bool, k: int, x: np.ndarray, expected: float
) -> tuple[float, float]:
    """Arc length and squared distance of the point of segment k that is closest to x."""
    gap, step = minus(x, points[k]), minus(points[k + 1], points[k])
    along = min(max(dot(gap, step) / dot(step, step), 0.0), 1.0)
    gap = minus(gap, (along * step[0], along * step[1], along * step[2]))
    square = dot(gap, gap)
    length = arc[-1]
    there = arc[k] + along * (arc[k + 1] - arc[k])
    if is_loop and not np.isnan(expected):
        there -= length * np.round((there - expected) / length)
    return there, square


def lengths(points: np.ndarray) -> np.ndarray:
    """(N,) length of a line (N, 2 or 3) up to each of its points."""
    return np.append(0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))


@njit(cache=True, nogil=True, error_model="numpy")
def nearest(
    points: np.ndarray, arc: np.ndarray, is_loop: bool, x: np.ndarray, expected: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Arc lengths (M,) of the points closest to x (M, 3), and squared distances (M,).

    expected : (M,) expected arc lengths, or nan. They distinguish the branches of a crease that
        comes close to itself; within a branch, only the distance counts. For a loop they may exceed
        its length, and so may the result.
    """
    result, squares = np.empty(len(x)), np.empty(len(x))
    for i in range(len(x)):
        least, branch, reach = np.inf, 0.0, np.inf
        if not np.isnan(expected[i]):
            for k in range(len(points) - 1):
                there, square = _closest(points, arc, is_loop, k, x[i], expected[i])
                off = EXPECTED * (there - expected[i])
                if square + off * off < least:
                    least, branch, reach = square + off * off, there, BRANCH * np.sqrt(square)
        least = np.inf
        for k in range(len(points) - 1):
            there, square = _closest(points, arc, is_loop, k, x[i], expected[i])
            if square < least and np.abs(there - branch) <= reach:
                least, result[i] = square, there
        squares[i] = least
    return result, squares


@njit(cache=True, nogil=True, error_model="numpy")
def expected(points: np.ndarray, arc: np.ndarray, is_loop: bool, x: np.ndarray) -> np.ndarray:
    """(M,) arc lengths of the vertices x (M, 3) of a path that is stretched evenly.

    For a loop, the path ends at its first vertex, where the arc length is the length of the crease.
    """
    result = np.zeros(len(x))
    for i in range(1, len(x)):
        step = minus(x[i], x[i - 1])
        result[i] = result[i - 1] + np.sqrt(dot(step, step))
    start = nearest(points, arc, is_loop, x[:1], np.full(1, np.nan))[0][0] if is_loop else 0.0
    return start + result * (arc[-1] / max(result[-1], 1e-30))


@njit(cache=True, nogil=True, error_model="numpy")
def spread(points: np.ndarray, arc: np.ndarray, is_loop: bool, x: np.ndarray) -> np.ndarray:
    """(M,) closest arc lengths of the vertices of a path at x, made ascending.

    Neighbours have a smallest distance, see `CLOSEST`. The first vertex of the path of a loop is
    not repeated.
    """
    n = len(x)
    closed = np.concatenate((x, x[:1])) if is_loop else x
    at, _ = nearest(points, arc, is_loop, x, expected(points, arc, is_loop, closed)[:n])
    space = CLOSEST * arc[-1] / (len(closed) - 1)
    slack = at - space * np.arange(n)
    high, low = slack.copy(), slack.copy()
    for i in range(1, n):
        high[i] = max(high[i], high[i - 1])
        low[n - 1 - i] = min(low[n - 1 - i], low[n - i])
    slack = (high + low) / 2
    begin = slack[0] if is_loop else 0.0
    slack = np.minimum(np.maximum(slack, begin), begin + (1 - CLOSEST) * arc[-1])
    return slack + space * np.arange(n)


@njit(cache=True, nogil=True, error_model="numpy")
def segments(arc: np.ndarray, is_loop: bool, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Segments (M,) that contain arc lengths (M,), and these lengths reduced to the crease."""
    if is_loop:
        inside = at - arc[-1] * np.floor(at / arc[-1])
    else:
        inside = np.minimum(np.maximum(at, 0.0), arc[-1])
    number = np.searchsorted(arc, inside, side="right") - 1
    return np.minimum(np.maximum(number, 0), len(arc) - 2), inside


@njit(cache=True, nogil=True, error_model="numpy")
def slide(
    points: np.ndarray,
    arc: np.ndarray,
    first: np.ndarray,
    is_loop: np.ndarray,
    x: np.ndarray,
    start: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Closest points (M, 3) of the paths of all routes, and directions of the creases there.

    points, arc : all creases in sequence; the crease of route r begins at first[r]
    x : (M, 3) vertices of all paths in sequence; the path of route r begins at start[r]
    """
    feet, way = np.empty_like(x), np.empty_like(x)
    for r in range(len(is_loop)):
        p, a = points[first[r] : first[r + 1]], arc[first[r] : first[r + 1]]
        at = spread(p, a, is_loop[r], x[start[r] : start[r + 1]])
        number, inside = segments(a, is_loop[r], at)
        for i in range(len(at)):
            k, m = number[i], start[r] + i
            length = a[k + 1] - a[k]
            share = (inside[i] - a[k]) / length
            for d in range(3):
                step = p[k + 1, d] - p[k, d]
                feet[m, d] = p[k, d] + share * step
                way[m, d] = step / length
    return feet, way
