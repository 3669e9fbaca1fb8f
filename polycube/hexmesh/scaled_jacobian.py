"""Scaled Jacobian of hexes as in VTK: the minimum over nine frames of each hex.

The frames are the edges at the eight corners, and the mean edges in the three directions.
"""

import numpy as np
from numba import njit

from polycube.hexmesh.connectivity import CORNERS, EDGES
from polycube.numerics.fast_math import FAST
from polycube.numerics.vectors import cross, dot

# three edges of the hex for each frame (12, 13, 14: the mean edges along xi, eta, zeta), and the
# sign of their determinant
_CORNER_EDGES = np.argmax(
    (np.sort(CORNERS[:, [[0, 1], [0, 2], [0, 3]]])[:, :, None] == np.sort(EDGES)).all(axis=3),
    axis=2,
)
FRAME_EDGES = np.vstack([_CORNER_EDGES, [12, 13, 14]])
FRAME_SIGNS = np.append(
    np.where(EDGES[_CORNER_EDGES, 0] == CORNERS[:, :1], 1.0, -1.0).prod(axis=1), 1.0
)


def scaled_jacobian(vertices: np.ndarray, hexes: np.ndarray) -> np.ndarray:
    """Smallest scaled Jacobian (H,) of each hex (H, 8) of vertices (V, 3).

    It is the minimum of det(a, b, c) / (|a| |b| |c|) over the nine frames a, b, c, in [-1, 1]; at
    most 0 for an inverted or flat hex, -1 for an edge without length.
    """
    given = np.ascontiguousarray(vertices, np.float64), np.ascontiguousarray(hexes, np.int64)
    return _scaled_jacobian(*(np.broadcast_to(each, each.shape) for each in given))  # read-only


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _scaled_jacobian(x: np.ndarray, hexes: np.ndarray) -> np.ndarray:
    result = np.ones(len(hexes))
    edge = np.zeros((15, 3))
    for h in range(len(hexes)):
        load_edges(x, hexes[h], edge)
        for f in range(9):
            a, b, c = edge[FRAME_EDGES[f, 0]], edge[FRAME_EDGES[f, 1]], edge[FRAME_EDGES[f, 2]]
            size = np.sqrt(dot(a, a)) * np.sqrt(dot(b, b)) * np.sqrt(dot(c, c))
            value = FRAME_SIGNS[f] * dot(a, cross(b, c)) / size if size > 0 else -1.0
            result[h] = min(result[h], max(value, -1.0))
    return result


@njit(cache=True, fastmath=FAST, error_model="numpy", inline="always")
def load_edges(x: np.ndarray, hex: np.ndarray, edge: np.ndarray) -> None:
    """Fill in the 12 edges of a hex (8,) and their means in each direction: edge (15, 3)."""
    for d in range(3):
        for k in range(12):
            edge[k, d] = x[hex[EDGES[k, 1]], d] - x[hex[EDGES[k, 0]], d]
        for k in range(3):
            mean = edge[4 * k, d] + edge[4 * k + 1, d] + edge[4 * k + 2, d] + edge[4 * k + 3, d]
            edge[12 + k, d] = mean / 4
