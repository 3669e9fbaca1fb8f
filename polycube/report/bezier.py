"""Outside of a Bezier solid as small quads: what the pictures draw of a spline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from polycube.spline.bernstein import bernstein
from polycube.types import Spline

# the six faces of a cubic element in its order i + 4 j + 16 k, first index fastest, seen from out
_GRID = np.arange(64).reshape(4, 4, 4)  # [k, j, i]
_FACES = np.stack(
    [
        _GRID[:, :, 0].T.ravel(),
        _GRID[:, :, 3].ravel(),
        _GRID[:, 0, :].ravel(),
        _GRID[:, 3, :].T.ravel(),
        _GRID[0].T.ravel(),
        _GRID[3].ravel(),
    ]
)


@dataclass(frozen=True, eq=False)
class Skin:
    """Small quads on the boundary; `points @ values` evaluates what the Bezier nodes carry."""

    points: csr_matrix  # (P, B) weight of each Bezier node at each point
    quads: np.ndarray  # (Q, 4) into points, counter-clockwise from outside
    edges: np.ndarray  # (L, 2) into points: pieces of the edges of the elements


def tessellate(spline: Spline, pieces: int = 4) -> Skin:
    """Boundary faces of the elements, each cut into pieces * pieces quads."""
    faces = boundary_faces(spline.nodes)
    line = bernstein(np.arange(pieces + 1) / pieces)  # (n, 4)
    weights = np.einsum("ai,bj->abij", line, line).reshape(-1, 16)  # slow parameter first
    n = pieces + 1
    rows = np.arange(len(faces) * n * n).reshape(len(faces), n * n)
    column = np.broadcast_to(faces[:, None, :], (len(faces), n * n, 16))
    values = np.broadcast_to(weights, column.shape)
    indptr = np.arange(0, values.size + 1, 16)
    size = spline.extraction.shape[0]
    points = csr_matrix((values.ravel(), column.ravel(), indptr), shape=(rows.size, size))

    local = np.arange(n * n).reshape(n, n)
    corners = [local[:-1, :-1], local[:-1, 1:], local[1:, 1:], local[1:, :-1]]
    quads = rows[:, np.stack([c.ravel() for c in corners], 1)].reshape(-1, 4)
    rim = np.concatenate([local[0], local[1:, -1], local[-1, -2::-1], local[-2::-1, 0]])
    edges = rows[:, np.stack([rim[:-1], rim[1:]], 1)].reshape(-1, 2)
    return Skin(points, quads, edges)


def boundary_faces(nodes: np.ndarray) -> np.ndarray:
    """(F, 16) Bezier nodes of the faces that belong to one element only; elements share nodes."""
    faces = nodes[:, _FACES].reshape(-1, 16)
    corners = np.sort(faces[:, [0, 3, 12, 15]], axis=1)
    _, first, count = np.unique(corners, axis=0, return_index=True, return_counts=True)
    return faces[np.sort(first[count == 1])]
