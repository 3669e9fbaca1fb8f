"""Faces of a surface that cross each other.

A box tree finds the faces whose boxes overlap; each edge of one is then tested against the other.
Faces with a common edge, and faces that only touch, do not count.
"""

import numpy as np
from numba import njit

from polycube.surface.closest import Tree, tree
from polycube.surface.measures import connected, diagonal
from polycube.types import TriMesh

TOUCH = 1e-10  # of the diagonal: an end this close to a plane is taken to be on it
BATCH = 50_000  # faces in one batch


def self_intersections(surface: TriMesh) -> np.ndarray:
    """(N, 2) pairs of faces that cross, ascending; the work grows as F log F."""
    corners = (surface.vertices - surface.vertices.mean(axis=0)) / diagonal(surface)
    triangles = corners[surface.faces]
    boxes = tree(triangles)
    found = [np.empty((0, 2), dtype=np.int64)]
    for start in range(0, len(triangles), BATCH):
        end = min(start + BATCH, len(triangles))
        pairs = overlapping_boxes(boxes, surface.faces, 1, start, end)
        found.append(pairs[_cross(triangles[pairs[:, 0]], triangles[pairs[:, 1]])])
    pairs = np.sort(np.concatenate(found), axis=1)
    return pairs[np.lexsort(pairs.T[::-1])]


def crossing_places(surface: TriMesh, pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Centre of a face (P, 3) for each place where faces cross, and number of pairs (P,),
    descending.

    pairs : (N, 2) of `self_intersections`; pairs whose faces share a vertex are one place
    """
    involved, local = np.unique(pairs, return_inverse=True)
    local, faces = local.reshape(-1, 2), surface.faces[involved]
    n, size = len(involved), len(involved) + len(surface.vertices)
    first = np.concatenate([local[:, 0], np.repeat(np.arange(n), 3)])
    second = np.concatenate([local[:, 1], n + faces.ravel()])
    _, place = np.unique(connected(first, second, size)[:n], return_inverse=True)
    count = np.bincount(place[local[:, 0]])
    middles = surface.vertices[faces].mean(axis=1)
    found = []
    for number in np.argsort(-count, kind="stable"):
        own = middles[place == number]  # the most central one: the mean of a ring is in its hole
        found.append(own[np.linalg.norm(own - own.mean(axis=0), axis=1).argmin()])
    return np.reshape(found, (-1, 3)), -np.sort(-count)


@njit(cache=True)
def overlapping_boxes(
    tree: Tree, faces: np.ndarray, shared: int, start: int, end: int
) -> np.ndarray:
    """Pairs of triangles whose bounding boxes overlap or touch.

    Parameters
    ----------
    tree : Tree
        Box tree of the T triangles.
    faces : (T, 3) int array
        Vertices of the triangles.
    shared : int
        Pairs with more common vertices are excluded.
    start, end : int
        Pairs i < j with ``start <= i < end`` are searched.

    Returns
    -------
    (N, 2) int array
        The pairs.
    """
    boxes = np.empty((len(faces), 6))
    for i in range(len(faces)):
        for d in range(3):
            a, b, c = tree.corners[i, 0, d], tree.corners[i, 1, d], tree.corners[i, 2, d]
            boxes[i, d], boxes[i, 3 + d] = min(a, b, c), max(a, b, c)
    pairs = np.empty((16 * (end - start), 2), np.int64)
    count = 0
    stack = np.zeros(128, np.int64)
    for i in range(start, end):
        own = boxes[i]
        stack[0], top = 0, 1
        while top > 0:
            top -= 1
            node = stack[top]
            if not _overlap(own, tree.box[node], 6):
                continue
            if tree.right[node] > 0:
                stack[top], stack[top + 1] = tree.right[node], node + 1
                top += 2
                continue
            for k in range(tree.first[node], tree.last[node]):
                j = tree.order[k]
                if j <= i or not _overlap(own, boxes[j], 3) or _common(faces, i, j) > shared:
                    continue
                if count == len(pairs):
                    pairs = np.concatenate((pairs, np.empty_like(pairs)))
                pairs[count] = i, j
                count += 1
    return pairs[:count]


@njit(cache=True, inline="always")
def _overlap(own: np.ndarray, other: np.ndarray, highest: int) -> bool:
    """Whether two boxes overlap; the upper coordinates of `other` start at index `highest`."""
    for d in range(3):
        if own[d] > other[highest + d] or other[d] > own[3 + d]:
            return False
    return True


@njit(cache=True, inline="always")
def _common(faces: np.ndarray, i: int, j: int) -> int:
    count = 0
    for a in range(3):
        for b in range(3):
            count += faces[i, a] == faces[j, b]
    return count


def _cross(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(N,) whether an edge of one triangle of each pair (N, 3, 3) passes through the other."""
    crossing = np.zeros(len(first), dtype=bool)
    for one, other in ((first, second), (second, first)):
        for corner in range(3):
            crossing |= _pierces(one[:, corner], one[:, (corner + 1) % 3], other)
    return crossing


def _pierces(p: np.ndarray, q: np.ndarray, triangle: np.ndarray) -> np.ndarray:
    """(N,) whether the segments p q pass through the triangles (N, 3, 3)."""
    a, b, c = np.moveaxis(triangle, 1, 0)
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    height_p, height_q = (np.einsum("ni,ni->n", end - a, normal) for end in (p, q))
    apart = np.minimum(np.abs(height_p), np.abs(height_q)) > TOUCH * area
    hit = apart & (height_p * height_q < 0)
    part = height_p[hit] / (height_p[hit] - height_q[hit])
    point = p[hit] + part[:, None] * (q - p)[hit]
    from_start = point[:, None] - triangle[hit]  # (H, 3, 3) from each corner
    sides = np.cross(np.roll(triangle[hit], -1, axis=1) - triangle[hit], from_start)
    hit[hit] = (np.einsum("hci,hi->hc", sides, normal[hit]) >= 0).all(axis=1)
    return hit
