"""Triangles of the polygons of a mesh file, the same for all formats."""

from typing import NamedTuple

import numpy as np
from numba import njit

from polycube.errors import InputError

FAN = 6  # polygons with more corners are cut ear by ear, also if they are convex
MOST = 10**9  # largest product of the numbers of corners and of reflex corners of a polygon
FEWER = 512  # ears after which the list of reflex corners is made shorter


class Soup(NamedTuple):
    """Triangles as they are in a file: (V, 3) vertices, (F, 3) faces, notes of the reader."""

    vertices: np.ndarray
    faces: np.ndarray
    notes: tuple[str, ...] = ()


def triangulated(vertices: np.ndarray, corners: np.ndarray, sizes: np.ndarray) -> Soup:
    """Divide polygons into triangles that lie inside of them and have their orientation.

    Raises InputError for fewer than three corners, unknown vertices, and polygons that cross
    themselves.

    vertices : (V, 3) coordinates
    corners : (N,) vertex numbers of all polygons in sequence
    sizes : (P,) number of corners of each polygon
    """
    if (sizes < 3).any():
        raise InputError(f"face {np.argmin(sizes) + 1} has {sizes.min()} corners, not three")
    for wrong in (corners.min(initial=0), corners.max(initial=-1)):
        if not -1 < wrong < len(vertices) and len(corners):
            what = f"a face refers to vertex {wrong + 1} of {len(vertices)}; it is out of range"
            raise InputError(what)
    first = np.cumsum(sizes) - sizes
    found = [corners[first[sizes == 3][:, None] + np.arange(3)]]
    for size in range(4, FAN + 1):
        rings = corners[first[sizes == size][:, None] + np.arange(size)]
        fans, is_inside = _fans(vertices, rings)
        found.append(fans[is_inside].reshape(-1, 3))
        found += [_cut(vertices, ring) for ring in rings[~is_inside]]
    for i in np.flatnonzero(sizes > FAN):
        found.append(_cut(vertices, corners[first[i] : first[i] + sizes[i]]))
    return Soup(vertices, np.concatenate(found))


def _fans(vertices: np.ndarray, rings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (P, n - 2, 3) of polygons (P, n) around their best corner, and if all are inside.

    At the best corner, the smallest cosine between a triangle and the polygon is largest.
    """
    n = rings.shape[1]
    start, i = np.arange(n)[:, None], np.arange(1, n - 1)
    places = np.stack([start + 0 * i, start + i, start + i + 1], axis=-1) % n
    fans = rings[:, places]  # (P, n starts, n - 2 triangles, 3)
    a, b, c = np.moveaxis(vertices[fans], 3, 0)
    areas = np.cross(b - a, c - a)
    normal = areas[:, 0].sum(axis=1)  # the same for every corner
    worst = np.einsum("psti,pi->pst", areas, normal).min(axis=2)
    chosen = np.arange(len(rings)), worst.argmax(axis=1)
    return fans[chosen], ~(worst[chosen] < 0)


def _cut(vertices: np.ndarray, ring: np.ndarray) -> np.ndarray:
    """Triangles (n - 2, 3) of a polygon (n,)."""
    points = vertices[ring] - vertices[ring[0]]
    place = vertices[ring[0]]
    # the normal; areas of triangles around the first corner
    normal = np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0)
    size = np.linalg.norm(normal)
    if not 0 < size < np.inf:  # it has no area, or its corners are not finite
        k = np.arange(1, len(ring) - 1)
        return np.stack([ring[0 * k], ring[k], ring[k + 1]], axis=1)
    across = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    across /= np.linalg.norm(across)
    flat = points @ np.stack([across, np.cross(normal / size, across)], axis=1)
    back, ahead = flat - np.roll(flat, 1, axis=0), np.roll(flat, -1, axis=0) - flat
    is_reflex = back[:, 0] * ahead[:, 1] - back[:, 1] * ahead[:, 0] < 0
    if len(ring) * is_reflex.sum() > MOST:
        raise InputError(f"the polygon of {len(ring)} corners at {place} has too many; split it up")
    found = _ears(flat, np.flatnonzero(is_reflex))
    if len(found) < len(ring) - 2:
        raise InputError(f"the polygon of {len(ring)} corners at {place} crosses itself")
    return ring[found]


@njit(cache=True)
def _ears(points: np.ndarray, reflex: np.ndarray) -> np.ndarray:
    """Cut ears from a counter-clockwise polygon (n, 2); fewer than n - 2 if there are no more.

    An ear is a corner that is not reflex, whose triangle contains no other corner. Only reflex
    corners can be in it.
    """
    n = len(points)
    before, after = np.arange(n) - 1, np.arange(n) + 1
    before[0], after[n - 1] = n - 1, 0
    found = np.zeros((n - 2, 3), np.int64)
    is_left = np.ones(n, np.bool_)
    count = tried = 0
    i = 0
    while count < n - 2 and tried <= n - count:
        a, c = before[i], after[i]
        pa, pb, pc = points[a], points[i], points[c]
        area = (pb[0] - pa[0]) * (pc[1] - pb[1]) - (pb[1] - pa[1]) * (pc[0] - pb[0])
        is_ear = area >= 0
        for k in range(len(reflex)) if is_ear and n - count > 3 else range(0):
            j = reflex[k]
            if not is_left[j] or j == a or j == i or j == c:
                continue
            p = points[j]
            if (pb[0] - pa[0]) * (p[1] - pa[1]) < (pb[1] - pa[1]) * (p[0] - pa[0]):
                continue
            if (pc[0] - pb[0]) * (p[1] - pb[1]) < (pc[1] - pb[1]) * (p[0] - pb[0]):
                continue
            if (pa[0] - pc[0]) * (p[1] - pc[1]) < (pa[1] - pc[1]) * (p[0] - pc[0]):
                continue
            if _is_apart(p, pa) and _is_apart(p, pb) and _is_apart(p, pc):
                is_ear = False
                break
        if is_ear:
            found[count] = a, i, c
            count += 1
            is_left[i] = False
            after[a], before[c] = c, a
            tried = 0
            i = after[c]  # not the next corner, for triangles of similar angles
            if count % FEWER == 0:  # corners that are cut or no longer reflex are in no other ear
                back, ahead = points[before[reflex]], points[after[reflex]]
                back, ahead = points[reflex] - back, ahead - points[reflex]
                turn = back[:, 0] * ahead[:, 1] - back[:, 1] * ahead[:, 0]
                reflex = reflex[is_left[reflex] & (turn < 0)]
        else:
            tried += 1
            i = c
    return found[:count]


@njit(cache=True)
def _is_apart(p: np.ndarray, q: np.ndarray) -> bool:
    """Whether two corners differ in place; a polygon with a hole passes some places twice."""
    return bool(p[0] != q[0] or p[1] != q[1])
