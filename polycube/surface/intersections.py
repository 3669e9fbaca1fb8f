"""Faces of a surface that cross each other.

A box tree finds the faces whose boxes overlap; each edge of one is then tested against the other.
Faces with a common edge, and faces that only touch, do not count.
"""

import numpy as np
from numba import njit

from polycube.errors import InputError
from polycube.surface.closest import Tree, tree
from polycube.surface.measures import connected, diagonal
from polycube.types import TriMesh

TOUCH = 1e-10  # of the diagonal: an end this close to a plane is taken to be on it
MOST = 200_000_000  # comparisons, in some 10 s; a scan needs about 50 for each face
FOUND = 100  # comparisons that are worth a pair, because of its memory


def self_intersections(surface: TriMesh) -> np.ndarray:
    """(N, 2) pairs of faces that cross, ascending.

    The work grows as F log F; raises InputError if the boxes of too many faces overlap.
    """
    corners = (surface.vertices - surface.vertices.mean(axis=0)) / diagonal(surface)
    try:
        pairs = overlapping_boxes(tree(corners[surface.faces]), surface.faces, 1, True, MOST)
    except OverflowError:
        raise InputError(
            f"intersecting faces were not searched for: too many of the {len(surface.faces)} faces "
            "lie close to many others"
        ) from None
    pairs = np.sort(pairs, axis=1)
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
    tree: Tree, faces: np.ndarray, shared: int, crossing: bool = False, most: int = 2**62
) -> np.ndarray:
    """Pairs of triangles whose bounding boxes overlap or touch.

    Parameters
    ----------
    tree : Tree
        Box tree of the T triangles, without groups.
    faces : (T, 3) int array
        Vertices of the triangles.
    shared : int
        Pairs with more common vertices are excluded.
    crossing : bool
        Only pairs in which an edge of one triangle passes through the other.
    most : int
        Largest number of comparisons.

    Returns
    -------
    (N, 2) int array
        The pairs, i < j.

    Raises
    ------
    OverflowError
        If more comparisons are needed.
    """
    corners, faces = tree.corners[tree.order], faces[tree.order]  # leaf by leaf
    boxes = np.empty((len(faces), 6))
    for i in range(len(faces)):
        for d in range(3):
            a, b, c = corners[i, 0, d], corners[i, 1, d], corners[i, 2, d]
            boxes[i, d], boxes[i, 3 + d] = min(a, b, c), max(a, b, c)
    pairs = np.empty((len(faces), 2), np.int64)
    count = compared = 0
    stack = np.zeros(128, np.int64)
    for i in range(len(faces)):
        own, plane = boxes[i], _plane(corners[i])
        stack[0], top = 0, 1
        while top > 0:
            top -= 1
            node = stack[top]
            if tree.last[node] <= i + 1 or not _overlap(own, tree.box[node], 6):
                continue
            if tree.right[node] > 0:
                stack[top], stack[top + 1] = tree.right[node], node + 1
                top += 2
                continue
            start = max(tree.first[node], i + 1)
            compared += tree.last[node] - start
            if compared + FOUND * count > most:
                raise OverflowError
            for j in range(start, tree.last[node]):
                if not _overlap(own, boxes[j], 3) or _common(faces, i, j) > shared:
                    continue
                if crossing and _is_beside(plane, corners[j]):
                    continue
                if crossing and not (_pierces(corners, i, j) or _pierces(corners, j, i)):
                    continue
                if count == len(pairs):
                    pairs = np.concatenate((pairs, np.empty_like(pairs)))
                one, other = tree.order[i], tree.order[j]
                pairs[count] = min(one, other), max(one, other)
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


@njit(cache=True)
def _plane(t: np.ndarray) -> tuple[float, float, float, float, float]:
    """Normal of a triangle, its product with a corner, and the error of such a product."""
    ux, uy, uz = t[1, 0] - t[0, 0], t[1, 1] - t[0, 1], t[1, 2] - t[0, 2]
    vx, vy, vz = t[2, 0] - t[0, 0], t[2, 1] - t[0, 1], t[2, 2] - t[0, 2]
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    error = TOUCH * (ux * ux + uy * uy + uz * uz + vx * vx + vy * vy + vz * vz)
    return x, y, z, t[0, 0] * x + t[0, 1] * y + t[0, 2] * z, error


@njit(cache=True, inline="always")
def _is_beside(plane: tuple[float, float, float, float, float], t: np.ndarray) -> bool:
    """Whether a triangle is on one side of a plane."""
    x, y, z, offset, error = plane
    first = t[0, 0] * x + t[0, 1] * y + t[0, 2] * z - offset
    second = t[1, 0] * x + t[1, 1] * y + t[1, 2] * z - offset
    third = t[2, 0] * x + t[2, 1] * y + t[2, 2] * z - offset
    return bool(min(first, second, third) > error or max(first, second, third) < -error)


@njit(cache=True)
def _pierces(corners: np.ndarray, i: int, j: int) -> bool:
    """Whether an edge of triangle i passes through triangle j."""
    x, y, z = corners[j, 0]
    ux, uy, uz = corners[j, 1, 0] - x, corners[j, 1, 1] - y, corners[j, 1, 2] - z
    vx, vy, vz = corners[j, 2, 0] - x, corners[j, 2, 1] - y, corners[j, 2, 2] - z
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    least = TOUCH * np.sqrt(nx * nx + ny * ny + nz * nz)
    p, q, r = corners[i]
    first = (p[0] - x) * nx + (p[1] - y) * ny + (p[2] - z) * nz
    second = (q[0] - x) * nx + (q[1] - y) * ny + (q[2] - z) * nz
    third = (r[0] - x) * nx + (r[1] - y) * ny + (r[2] - z) * nz
    if max(first, second, third) <= least or min(first, second, third) >= -least:
        return False
    for k, low, high in ((0, first, second), (1, second, third), (2, third, first)):
        p, q = corners[i, k], corners[i, (k + 1) % 3]
        if min(abs(low), abs(high)) <= least or (low > 0) == (high > 0):
            continue
        part = low / (low - high)
        px, py, pz = p + part * (q - p)
        inside = True
        for c in range(3):
            start, end = corners[j, c], corners[j, (c + 1) % 3]
            ux, uy, uz = end[0] - start[0], end[1] - start[1], end[2] - start[2]
            vx, vy, vz = px - start[0], py - start[1], pz - start[2]
            side = (uy * vz - uz * vy) * nx + (uz * vx - ux * vz) * ny + (ux * vy - uy * vx) * nz
            inside &= side >= 0
        if inside:
            return True
    return False
