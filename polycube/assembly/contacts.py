"""Contacts between the surfaces of two CAD solids: pairs of faces, and their common area.

Triangles are in contact if they face each other within a small distance: each triangle of one
surface is clipped by the three planes through the sides of a triangle of the other, and the area of
the rest is measured.
"""

from dataclasses import dataclass

import numpy as np

from polycube.surface.measures import diagonal, face_areas, face_normals, twins
from polycube.types import TriMesh

NEAR = 1e-4  # of the diagonal of the smaller solid: largest distance of flat faces in contact
FACING = -np.cos(np.radians(30))  # largest cosine between the normals of triangles in contact
# smallest share of the smaller face, if both are flat, and if not
LEAST = {True: 1e-4, False: 0.05}
PAIRS = 1 << 20  # pairs of triangles in a batch


@dataclass(frozen=True)
class Contact:
    """Two CAD faces of different solids that are in contact."""

    first: int  # number of the face of each solid, from 1
    second: int
    area: float  # contact area in squared model units
    share: float  # contact area divided by the area of the smaller face


def contacts(first: TriMesh, second: TriMesh) -> list[Contact]:
    """Find the CAD faces of two solids that are in contact.

    The tolerance of flat faces is `NEAR`. For round faces it is increased by the height of the arcs
    over their triangles, so a smaller clearance is not detected. An area below `LEAST`, such as
    that of a cylinder on a plane, is not a contact.

    first, second : surfaces with CAD faces (`region`)
    """
    near = NEAR * min(diagonal(first), diagonal(second))
    slack = _slack(first), _slack(second)
    a, b, height, area = _overlaps(first, second, near + max(slack[0].max(), slack[1].max()))
    sides = first.region[a], second.region[b]
    in_contact = height <= near + slack[0][sides[0]] + slack[1][sides[1]]
    pairs, number = np.unique(np.stack(sides)[:, in_contact], axis=1, return_inverse=True)
    total = np.bincount(number.ravel(), area[in_contact])
    total_areas = [np.bincount(each.region, face_areas(each)) for each in (first, second)]
    found = []
    for (f, g), own in zip(pairs.T.tolist(), total.tolist(), strict=True):
        share = own / min(total_areas[0][f], total_areas[1][g])
        if share > LEAST[slack[0][f] + slack[1][g] <= near]:
            found.append(Contact(f, g, own, share))
    return found


def _slack(surface: TriMesh) -> np.ndarray:
    """Height of the arc over the triangles of each CAD face; 0 for a flat face."""
    normals, areas = face_normals(surface), face_areas(surface)
    side, other = twins(surface.faces)
    a, b = side // 3, other // 3
    within = surface.region[a] == surface.region[b]
    a, b, side = a[within], b[within], side[within]
    angle = np.arccos(np.clip((normals[a] * normals[b]).sum(axis=1), -1, 1))
    corner = surface.faces.ravel()[[side, side - side % 3 + (side + 1) % 3]]
    length = np.linalg.norm(surface.vertices[corner[0]] - surface.vertices[corner[1]], axis=1)
    across = 2 * np.maximum(areas[a], areas[b]) / length
    slack = np.zeros(surface.region.max() + 1)
    np.maximum.at(slack, surface.region[a], across * np.tan(angle / 4))
    return slack


def _overlaps(
    first: TriMesh, second: TriMesh, near: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Triangles (P,), (P,) that face each other, their distance (P,) and common area (P,)."""
    corners = [each.vertices[each.faces] for each in (first, second)]
    boxes = [(each.min(axis=1) - near / 2, each.max(axis=1) + near / 2) for each in corners]
    low = np.maximum(*(box[0].min(axis=0) for box in boxes))
    high = np.minimum(*(box[1].max(axis=0) for box in boxes))
    own, other = (np.flatnonzero(((box[0] <= high) & (box[1] >= low)).all(axis=1)) for box in boxes)
    normals = [face_normals(each) for each in (first, second)]
    found = [(np.zeros(0, np.int64),) * 2 + (np.zeros(0),) * 2]
    step = max(1, PAIRS // max(len(other), 1))
    for rows in np.split(own, range(step, len(own), step)):
        meet = normals[0][rows] @ normals[1][other].T < FACING
        for axis in range(3):
            meet &= boxes[0][0][rows, None, axis] <= boxes[1][1][other, axis]
            meet &= boxes[0][1][rows, None, axis] >= boxes[1][0][other, axis]
        i, j = np.nonzero(meet)
        a, b = rows[i], other[j]
        height, area = _common(corners[0][a], normals[0][a], corners[1][b])
        seen = area > 0
        found.append((a[seen], b[seen], height[seen], area[seen]))
    a, b, height, area = map(np.concatenate, zip(*found, strict=True))
    return a, b, height, area


def _common(
    base: np.ndarray, normal: np.ndarray, other: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Mean distance from the plane of a triangle, and area, of the part of another above it.

    base, other : (P, 3, 3); normal : (P, 3) of the base
    """
    polygon = other
    for k in range(3):
        start, end = base[:, k], base[:, (k + 1) % 3]
        inwards = np.cross(normal, end - start)
        polygon = _cut(polygon, ((polygon - start[:, None]) * inwards[:, None]).sum(axis=2))
    fan = polygon[:, 1:-1] - polygon[:, :1], polygon[:, 2:] - polygon[:, :1]
    area = np.linalg.norm(np.cross(*fan), axis=2) / 2
    middle = (polygon[:, :1] + polygon[:, 1:-1] + polygon[:, 2:]) / 3
    height = np.abs(((middle - base[:, :1]) * normal[:, None]).sum(axis=2))
    total = area.sum(axis=1)
    return (height * area).sum(axis=1) / total.clip(np.finfo(float).tiny), total


def _cut(polygon: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Part of each convex polygon (P, M, 3) where `inside` (P, M) is positive, (P, M + 1, 3).

    Unused corners are at the first one.
    """
    number, size, _ = polygon.shape
    after, beyond = np.roll(polygon, -1, axis=1), np.roll(inside, -1, axis=1)
    crosses = (inside > 0) != (beyond > 0)
    share = inside / np.where(crosses, inside - beyond, 1)
    corners = np.stack([polygon, polygon + share[:, :, None] * (after - polygon)], axis=2)
    is_used = np.stack([inside > 0, crosses], axis=2).reshape(number, 2 * size)
    order = np.argsort(~is_used, axis=1, kind="stable")[:, : size + 1]
    order = np.where(np.arange(size + 1) < is_used.sum(axis=1)[:, None], order, order[:, :1])
    return np.take_along_axis(corners.reshape(number, 2 * size, 3), order[:, :, None], axis=1)
