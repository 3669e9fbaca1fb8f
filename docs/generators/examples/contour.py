"""Triangulate the zero level of an implicit solid.

Each grid cell that the surface crosses has a vertex, and each grid edge that it crosses has a quad
of four vertices (dual contouring). Vertices then slide along the surface towards the mean of their
neighbours, which makes the triangles regular, and finally onto the sharp edges of the solid, where
the planes of adjacent faces meet.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array

from docs.generators.examples.implicit import Field
from polycube.surface.checks import check_surface
from polycube.surface.repair.remesh import towards_planes
from polycube.types import TriMesh

SMOOTHING = 12  # smoothing iterations
SHARPENING = 4  # iterations that move vertices to sharp edges
EVEN = 0.4  # smallest evenness of a triangle after a move
STIFFNESS = 0.1  # stiffness of a point in directions that its planes do not determine
STEP = 1e-3  # of a cell: step of finite differences
TIE = 1e-6  # relative difference of the distances of diagonals that counts


def contour(field: Field, low: np.ndarray, high: np.ndarray, cell: float) -> TriMesh:
    """Closed surface of the solid, which must be inside the box from `low` to `high`.

    Faces are about `cell` wide. Raises ValueError if the solid leaves the box, and InputError if
    the grid is too coarse for a manifold.
    """
    shape = np.ceil(np.subtract(high, low) / cell).astype(int) + 1
    nodes = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), axis=-1)
    values = field((low + cell * nodes).reshape(-1, 3)).reshape(shape)
    if min(values.take(end, axis).min() for axis in range(3) for end in (0, -1)) <= 0:
        raise ValueError(f"the solid leaves the box from {low} to {high}")
    quads, cells = _dual_quads(values < 0)
    points = _project(field, low + cell * (cells + 0.5), cell)
    points = _spread(field, points, quads, cell)
    points = _where_even(points, _sharpen(field, points, quads, cell), field, quads)
    points = _project(field, points, cell)
    surface = TriMesh(points, _halves(field, points, quads))
    check_surface(surface)
    return surface


def _dual_quads(inside: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Quads (Q, 4), outward, of cells (V, 3), one quad around each crossed edge."""
    corners = []
    for axis in range(3):
        before, after = (np.delete(inside, end, axis) for end in (-1, 0))
        edge = np.argwhere(before != after)
        around = np.zeros((4, 3), dtype=int)
        around[:, (axis + 1) % 3] = [-1, 0, 0, -1]
        around[:, (axis + 2) % 3] = [-1, -1, 0, 0]
        quad = edge[:, None] + around  # counter-clockwise seen from the far end of the axis
        leaves = before[tuple(edge.T)]
        corners.append(np.where(leaves[:, None, None], quad, quad[:, ::-1]))
    quads = np.concatenate(corners)
    cells, quads = np.unique(quads.reshape(-1, 3), axis=0, return_inverse=True)
    return quads.reshape(-1, 4), cells


def _project(field: Field, points: np.ndarray, cell: float) -> np.ndarray:
    """Move points along the gradient to the zero level, by at most half a cell in each step."""
    for _ in range(4):
        value, gradient = field(points), _gradient(field, points, cell)
        move = value[:, None] * gradient / (gradient**2).sum(axis=1, keepdims=True)
        length = np.linalg.norm(move, axis=1, keepdims=True)
        points = points - move * np.minimum(1, cell / 2 / np.maximum(length, 1e-300))
    return points


def _gradient(field: Field, points: np.ndarray, cell: float) -> np.ndarray:
    offsets = STEP * cell * np.eye(3)
    gradient = np.stack([field(points + o) - field(points - o) for o in offsets], axis=1)
    return gradient / (2 * STEP * cell)


def _spread(field: Field, points: np.ndarray, quads: np.ndarray, cell: float) -> np.ndarray:
    """Move every point to the mean of its neighbours on the surface."""
    first, second = np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2).T
    size = (len(points), len(points))
    links = coo_array((np.ones(len(first)), (first, second)), shape=size).tocsr()
    degree = links.sum(axis=1)[:, None]
    for _ in range(SMOOTHING):
        points = _project(field, (points + links @ points / degree) / 2, cell)
    return points


def _sharpen(field: Field, points: np.ndarray, quads: np.ndarray, cell: float) -> np.ndarray:
    """Move every point by up to half a cell to the intersection of the planes of its quads."""
    for _ in range(SHARPENING):
        feet = _project(field, points[quads].mean(axis=1), cell)
        normals = _gradient(field, feet, cell)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        points = towards_planes(points, quads, feet, normals, STIFFNESS, cell / 2)
    return _project(field, points, cell)


def _where_even(
    points: np.ndarray, moved: np.ndarray, field: Field, quads: np.ndarray
) -> np.ndarray:
    """The moved points; moves that make a triangle thin are halved or taken back."""
    share = np.ones((len(points), 1))
    for _ in range(6):
        there = points + share * (moved - points)
        faces = _halves(field, there, quads)
        share[faces[_evenness(there[faces]) < EVEN].ravel()] /= 2
    return points + np.where(share > 0.1, share, 0) * (moved - points)


def _evenness(corners: np.ndarray) -> np.ndarray:
    """(F,) shape of the triangles: 1 for equilateral ones, 0 for flat ones."""
    sides = corners - np.roll(corners, 1, axis=1)
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    return 2 * np.sqrt(3) * area / (sides**2).sum(axis=(1, 2))


def _halves(field: Field, points: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """(F, 3) triangles: each quad is divided along the diagonal closer to the surface.

    Diagonals as close as each other, of symmetric quads, are told apart by their order: not by
    rounding, which differs between machines.
    """
    a, b, c, d = points[quads].transpose(1, 0, 2)
    first, second = (
        np.abs(field((p + q) / 2)) + 0.02 * np.linalg.norm(p - q, axis=1)
        for p, q in ((a, c), (b, d))
    )
    quads = np.where((second < first * (1 - TIE))[:, None], np.roll(quads, -1, axis=1), quads)
    return quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
