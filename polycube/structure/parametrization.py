"""Where the vertices of a surface lie on the polycube, through a hex mesh registered to it."""

from __future__ import annotations

import numpy as np

from polycube.surface import closest
from polycube.surface.fit_target import target
from polycube.types import HexMesh, Parametrization, TriMesh


def pull_back(
    surface: TriMesh, hexes: HexMesh, positions: np.ndarray, alpha: float = 0.05
) -> Parametrization:
    """Polycube positions of the surface's vertices, on the boundary of the polycube.

    hexes : registered to the surface
    positions : (V, 3) polycube position of each vertex of the hexes
    alpha : length that a whole turn of the normal is worth, in diagonals
    """
    goal = target(surface)
    triangles = hexes.quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    corners = goal.to_unit(hexes.vertices)[triangles]
    tree = closest.tree(corners, unit_normals(corners))
    _, face, weight = closest.closest(tree, goal.surface.vertices, goal.vertex_normals, alpha)
    return Parametrization(np.einsum("vk,vkd->vd", weight, positions[triangles[face]]))


def unit_normals(corners: np.ndarray) -> np.ndarray:
    """(T, 3) of triangles (T, 3, 3); zero where a triangle has no area."""
    vectors = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
