"""Close the holes of a surface: the triangulation of a loop with the smallest area.

The minimum over all triangulations of a polygon in space is found by dynamic programming, after
Barequet and Sharir, *Filling gaps in the boundary of a polyhedron*, CAGD 12 (1995). For a flat hole
of any outline the triangles do not overlap.
"""

import numpy as np

from polycube.surface.measures import diagonal, half_edges, twins
from polycube.types import TriMesh

MAX_LOOP = 1000  # edges of a hole; the work grows with the third power
EVEN = 1e-3  # of the area of a square with this edge: prefers well-shaped triangles at equal area


def loops(faces: np.ndarray) -> list[np.ndarray]:
    """Vertices of the border of each hole, in the direction in which new faces traverse it.

    Neighbouring faces must have consistent orientations. Holes that touch at a vertex are separate.
    """
    first, second = twins(faces)
    alone = np.ones(faces.size, dtype=bool)
    alone[first] = alone[second] = False
    after: dict[int, list[int]] = {}
    for a, b in half_edges(faces)[alone].tolist():
        after.setdefault(b, []).append(a)
    found = []
    while after:
        path = [next(iter(after))]
        while path and path[-1] in after:
            following = after[path[-1]]
            vertex = following.pop()
            if not following:
                del after[path[-1]]
            if vertex in path:
                start = path.index(vertex)
                found.append(np.array(path[start:]))
                path = path[: start + 1]
            else:
                path.append(vertex)
    return found


def flatness(points: np.ndarray) -> float:
    """Largest distance of a loop (N, 3) from its mean plane, over the diagonal of its box."""
    away = points - points.mean(axis=0)
    normal = np.linalg.svd(away, full_matrices=False)[2][-1]
    return float(np.abs(away @ normal).max() / (np.linalg.norm(np.ptp(points, axis=0)) or 1.0))


def filling(points: np.ndarray) -> np.ndarray:
    """(N - 2, 3) triangles of least total area, as indices of the points (N, 3) of a loop."""
    scale = np.linalg.norm(np.ptp(points, axis=0)) or 1.0
    cut = _cuts((points - points.mean(axis=0)) / scale)
    triangles, todo = [], [(0, len(points) - 1)]
    while todo:
        i, k = todo.pop()
        if k - i > 1:
            j = int(cut[i, k])
            triangles.append((i, j, k))
            todo += [(i, j), (j, k)]
    return np.array(triangles)


def nested(surface: TriMesh, found: list[np.ndarray]) -> np.ndarray:
    """(L,) whether a loop lies in its own plane inside the box of another, or contains another."""
    low = np.array([surface.vertices[loop].min(axis=0) for loop in found])
    high = np.array([surface.vertices[loop].max(axis=0) for loop in found])
    slack = 1e-3 * diagonal(surface)
    inside = np.zeros(len(found), dtype=bool)
    for i in range(len(found)):
        holds = (low[i] >= low - slack).all(axis=1) & (high[i] <= high + slack).all(axis=1)
        holds[i] = False
        inside |= holds
        inside[i] |= holds.any()
    return inside


def _cuts(points: np.ndarray) -> np.ndarray:
    """(N, N) third corner of the triangle on each diagonal of the best triangulation."""
    n = len(points)
    square = ((points[:, None] - points) ** 2).sum(axis=2)
    cost, cut = np.zeros((n, n)), np.zeros((n, n), np.int64)
    for gap in range(2, n):
        first = np.arange(n - gap)
        last, i = first + gap, first[:, None]
        j, k = i + np.arange(1, gap), i + gap
        twice = np.linalg.norm(np.cross(points[j] - points[i], points[k] - points[i]), axis=2)
        edges = square[i, j] + square[i, k] + square[j, k]
        value = cost[i, j] + cost[j, k] + 0.5 * twice + EVEN * edges
        best = value.argmin(axis=1)
        cost[first, last], cut[first, last] = value[first, best], first + 1 + best
    return cut
