"""The surface of a lattice as small triangles with the numbers of their knot planes.

It is rounded by a few smoothing steps, with its bounding box unchanged.
"""

from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix

from polycube.structure.lattice import CORNERS, exposed
from polycube.types import PerAxis

TRIANGLES = 8000  # largest number; two pieces are always few enough
PIECES = (8, 6, 4, 3, 2)  # numbers of pieces of a slab that are tried
GRADING = 0.5  # 0: equal pieces; towards 1: smaller ones at the knots, for fillets
SHORT = 1e-3  # of the longest edge of the box: lower bound of the length of an edge


class Tessellation(NamedTuple):
    """Triangles of the surface of a lattice, counter-clockwise from outside."""

    vertices: np.ndarray  # (V, 3)
    quads: np.ndarray  # (Q, 4) into vertices, counter-clockwise from outside
    faces: np.ndarray  # (2 Q, 3) indices of vertices: the two triangles of each quad
    axis: np.ndarray  # (2 Q,) 0..5, outward, see types.AXES
    knot: np.ndarray  # (2 Q,) number of the knot on that axis


def tessellate(occupancy: np.ndarray, knots: PerAxis, pieces: int | None = None) -> Tessellation:
    """Surface of boxes (X, Y, Z) between knots, each slab divided into pieces.

    pieces : default: the largest of PIECES with at most TRIANGLES triangles
    """
    axis, box = exposed(occupancy)
    pieces = pieces or next((n for n in PIECES if 2 * len(axis) * n**2 <= TRIANGLES), PIECES[-1])
    shape = pieces * np.array(occupancy.shape) + 1
    at = _corners(axis, box, pieces)  # (Q, n, n, 4, 3)
    number = np.ravel_multi_index(np.moveaxis(at, -1, 0), shape).reshape(-1, 4)
    is_used = np.zeros(np.prod(shape), bool)
    is_used[number] = True
    index = np.unravel_index(np.flatnonzero(is_used), shape)
    nodes = [cut(each, pieces) for each in knots]
    vertices = np.stack([n[i] for n, i in zip(nodes, index, strict=True)], axis=1)
    quads = (np.cumsum(is_used) - 1)[number]
    plane = box[np.arange(len(axis)), axis // 2] + 1 - axis % 2
    faces = quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    labels = axis.repeat(2 * pieces**2), plane.repeat(2 * pieces**2)
    return Tessellation(vertices, quads, faces, *labels)


def cut(knots: np.ndarray, pieces: int) -> np.ndarray:
    """Knots after dividing the slabs between them into pieces that are smaller near the knots."""
    t = np.arange(pieces) / pieces
    t = t - GRADING * np.sin(2 * np.pi * t) / (2 * np.pi)
    return np.append(knots[:-1, None] + np.diff(knots)[:, None] * t, knots[-1])


def _corners(axis: np.ndarray, box: np.ndarray, pieces: int) -> np.ndarray:
    """(Q, n, n, 4, 3) indices of the corners of the n x n pieces of box faces."""
    corner = np.broadcast_to(CORNERS[axis][:, None, None], (len(axis), pieces, pieces, 4, 3))
    piece = np.zeros((3, pieces, pieces, 3), np.int64)  # position of a piece, for each axis
    for normal in range(3):
        across = np.delete(np.arange(3), normal)
        piece[normal][..., across] = np.moveaxis(np.indices((pieces, pieces)), 0, -1)
    is_normal = np.arange(3) == axis[:, None] // 2
    scale = np.where(is_normal, pieces, 1)[:, None, None, None]
    origin = pieces * box[:, None, None, None] + piece[axis // 2][:, :, :, None]
    return origin + scale * corner


def smoothed(vertices: np.ndarray, quads: np.ndarray, steps: int) -> np.ndarray:
    """(V, 3) vertices after `steps` moves halfway to the mean of their neighbours.

    Neighbours are the other ends of the edges of the quads (Q, 4), where each edge belongs to two
    quads, with the inverse length of the edge as weight. Points on a flat face hardly move along
    it.
    """
    low, extent = vertices.min(axis=0), np.ptp(vertices, axis=0)
    n = len(vertices)
    a, b = quads.ravel(), np.roll(quads, -1, axis=1).ravel()  # each edge once in each direction
    lengths = np.linalg.norm(vertices[a] - vertices[b], axis=1)
    weights = 1 / np.maximum(lengths, SHORT * extent.max())
    near, total = csr_matrix((weights, (a, b)), shape=(n, n)), np.bincount(a, weights, n)
    x = vertices
    for _ in range(steps):
        x = (x + near @ x / total[:, None]) / 2
    return (x - x.min(axis=0)) / np.ptp(x, axis=0) * extent + low
