"""Rays along the axes and triangles sorted into strips."""

import numpy as np
from numba import njit

STRIPS = 256  # number of strips of the triangles, of which a ray needs one


def strips(places: np.ndarray) -> tuple[float, float, np.ndarray, np.ndarray]:
    """Sort triangles into strips of one coordinate (F, 3) of their corners.

    Returns
    -------
    Start of the first strip, width of a strip, triangles of the strips in sequence, and start of
    each strip (STRIPS + 1,)
    """
    start = float(places.min())
    width = float(np.ptp(places)) / STRIPS + 1e-30
    number = np.clip(((places - start) / width).astype(np.int64), 0, STRIPS - 1)
    first, last = number.min(axis=1), number.max(axis=1)
    count = last - first + 1
    triangle = np.repeat(np.arange(len(places)), count)
    strip = first[triangle] + np.arange(len(triangle)) - np.repeat(np.cumsum(count) - count, count)
    order = np.argsort(strip, kind="stable")
    return start, width, triangle[order], np.searchsorted(strip[order], np.arange(STRIPS + 1))


@njit(cache=True)
def first_hit(
    corners: np.ndarray,
    start: float,
    width: float,
    triangles: np.ndarray,
    begin: np.ndarray,
    origin: np.ndarray,
    axis: int,
    sign: float,
    skip: int,
) -> tuple[int, float]:
    """First triangle along an axis from a point, and its distance; -1 if there is none.

    start, width, triangles, begin : see `strips`, of the axis after this one
    """
    u, v = (axis + 1) % 3, (axis + 2) % 3
    best, at = np.inf, -1
    strip = min(max(int((origin[u] - start) / width), 0), len(begin) - 2)
    for t in triangles[begin[strip] : begin[strip + 1]]:
        if t == skip:
            continue
        ax, ay = corners[t, 0, u] - origin[u], corners[t, 0, v] - origin[v]
        bx, by = corners[t, 1, u] - origin[u], corners[t, 1, v] - origin[v]
        cx, cy = corners[t, 2, u] - origin[u], corners[t, 2, v] - origin[v]
        a, b, c = bx * cy - by * cx, cx * ay - cy * ax, ax * by - ay * bx
        if not ((a >= 0 and b >= 0 and c >= 0) or (a <= 0 and b <= 0 and c <= 0)):
            continue
        total = a + b + c
        if abs(total) < 1e-18:
            continue
        height = (
            a * corners[t, 0, axis] + b * corners[t, 1, axis] + c * corners[t, 2, axis]
        ) / total
        distance = (height - origin[axis]) * sign
        if 1e-9 < distance < best:
            best, at = distance, t
    return at, best
