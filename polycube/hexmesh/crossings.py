"""Self-intersections of the boundary of a hex mesh.

A boundary quad is a bilinear patch. It is replaced by two triangles, split along the diagonal from
the first corner of the face in the order of faces of Abaqus (S1 to S6), as in programs that
triangulate the boundary of a hex mesh. Two triangles without a common vertex are disjoint if and
only if a plane separates them, and it is sufficient to test planes of finitely many directions
(separating axes: both normals, the cross products of edges of one with edges of the other and, for
coplanar triangles, the normals of edges in their plane). Rounding errors cannot produce a
separating plane. Triangles that touch, or overlap in one plane, count as crossing.
"""

import numpy as np
from numba import njit

from polycube.hexmesh.connectivity import FACES, quad_sides
from polycube.numerics.vectors import Vector, cross
from polycube.surface.closest import tree
from polycube.surface.intersections import overlapping_boxes
from polycube.types import HexMesh

# the faces 3-0-4-7 and 2-3-7-6 of `connectivity.FACES` start next to the first corner of Abaqus
_OTHER_DIAGONAL = np.array([True, False, False, True, False, False])
# number of crossing pairs of quads above which later stages are not expected to separate them
MOST_CROSSINGS = 20
_GAP = 1e-9  # of the size of two triangles: a smaller gap is a contact


def crossings(mesh: HexMesh) -> np.ndarray:
    """Find the pairs of boundary quads that cross or touch each other.

    Parameters
    ----------
    mesh : HexMesh

    Returns
    -------
    (N, 2) int array
        Indices i < j of ``mesh.quads``, in lexical order. Triangles with a common vertex do not
        count, so neighbouring quads are found only if they fold over each other elsewhere.
    """
    triangles, quad = _split(mesh)
    corners = mesh.vertices[triangles]
    boxes = tree(corners)
    pairs = overlapping_boxes(boxes, triangles, 0)
    found = np.sort(quad[pairs[_meet(corners, pairs)]], axis=1)
    return np.unique(found, axis=0)


def _split(mesh: HexMesh) -> tuple[np.ndarray, np.ndarray]:
    """Two triangles of each quad (2 Q, 3), and the quad of each triangle (2 Q,)."""
    hexa, face = quad_sides(mesh)
    quads = mesh.hexes[hexa[:, None], FACES[face]]
    quads = np.where(_OTHER_DIAGONAL[face, None], np.roll(quads, -1, axis=1), quads)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return triangles, np.tile(np.arange(len(quads)), 2)


@njit(cache=True, error_model="numpy")
def _meet(corners: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """(N,) whether the triangles (T, 3, 3) of each pair (N, 2) have a common point."""
    found = np.zeros(len(pairs), np.bool_)
    points = np.empty((6, 3))
    for n in range(len(pairs)):
        size = 0.0
        for k in range(6):
            for d in range(3):
                points[k, d] = corners[pairs[n, k // 3], k % 3, d] - corners[pairs[n, 0], 0, d]
                size = max(size, abs(points[k, d]))
        found[n] = not _separated(points, _GAP * size)
    return found


@njit(cache=True, error_model="numpy")
def _separated(points: np.ndarray, gap: float) -> bool:
    """Whether a plane separates the triangles of points 0-2 and 3-5 by more than `gap`."""
    first, second = _normal(points, 0), _normal(points, 3)
    if _separates(points, first, gap) or _separates(points, second, gap):
        return True
    for i in range(3):
        edge = _edge(points, i)
        if _separates(points, cross(first, edge), gap):
            return True
        if _separates(points, cross(second, _edge(points, 3 + i)), gap):
            return True
        for j in range(3, 6):
            if _separates(points, cross(edge, _edge(points, j)), gap):
                return True
    return False


@njit(cache=True, error_model="numpy", inline="always")
def _separates(points: np.ndarray, axis: Vector, gap: float) -> bool:
    low, high, lowest, highest = np.inf, -np.inf, np.inf, -np.inf
    for k in range(3):
        at = axis[0] * points[k, 0] + axis[1] * points[k, 1] + axis[2] * points[k, 2]
        low, high = min(low, at), max(high, at)
        k += 3
        at = axis[0] * points[k, 0] + axis[1] * points[k, 1] + axis[2] * points[k, 2]
        lowest, highest = min(lowest, at), max(highest, at)
    length = np.sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2])
    return max(lowest - high, low - highest) > gap * length


@njit(cache=True, error_model="numpy", inline="always")
def _edge(points: np.ndarray, k: int) -> Vector:
    """Vector from point k to the next point of its triangle."""
    after = k - 2 if k % 3 == 2 else k + 1
    return (
        points[after, 0] - points[k, 0],
        points[after, 1] - points[k, 1],
        points[after, 2] - points[k, 2],
    )


@njit(cache=True, error_model="numpy", inline="always")
def _normal(points: np.ndarray, k: int) -> Vector:
    return cross(_edge(points, k), _edge(points, k + 1))
