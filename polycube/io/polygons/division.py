"""Triangles of the polygons of a mesh file, the same for all formats."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from mapbox_earcut import triangulate_float64

from polycube.errors import InputError

FAN = 6  # polygons with more corners are cut ear by ear, also if they are convex
SAME = 1e-9  # relative difference of areas


class Soup(NamedTuple):
    """Triangles as they are in a file: (V, 3) vertices, (F, 3) faces, notes of the reader."""

    vertices: np.ndarray
    faces: np.ndarray
    notes: tuple[str, ...] = ()


def triangulated(vertices: np.ndarray, corners: np.ndarray, sizes: np.ndarray) -> Soup:
    """Divide polygons into triangles that lie inside of them and have their orientation.

    Parameters
    ----------
    vertices : (V, 3) coordinates
    corners : (N,) vertex numbers of all polygons in sequence
    sizes : (P,) number of corners of each polygon

    Raises
    ------
    InputError : for fewer than three corners, unknown vertices, and polygons that cross themselves
    """
    if (sizes < 3).any():
        raise InputError(f"face {np.argmin(sizes) + 1} has {sizes.min()} corners, not three")
    for wrong in (corners.min(initial=0), corners.max(initial=-1)):
        if not -1 < wrong < len(vertices) and len(corners):
            raise InputError(
                f"a face refers to vertex {wrong + 1} of {len(vertices)}; it is out of range"
            )
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
    found = triangulate_float64(flat, np.array([len(ring)], np.uint32)).reshape(-1, 3).astype(int)
    a, b, c = np.moveaxis(flat[found], 1, 0)
    areas = np.abs(np.cross(b - a, c - a)).sum() if len(found) else 0.0
    if len(found) < len(ring) - 2 or abs(areas - size) > SAME * size:
        raise InputError(f"the polygon of {len(ring)} corners at {place} crosses itself")
    return ring[found]
