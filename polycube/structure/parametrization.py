"""Positions of the vertices of a surface on the polycube, through a registered hex mesh."""

import numpy as np

from polycube.surface import closest
from polycube.surface.fit_target import target
from polycube.surface.measures import triangle_vectors, unit
from polycube.types import HexMesh, Parametrization, TriMesh


def pull_back(
    surface: TriMesh, hexes: HexMesh, positions: np.ndarray, alpha: float = 0.05
) -> Parametrization:
    """Positions of the vertices of the surface on the boundary of the polycube.

    hexes : hex mesh registered to the surface
    positions : (V, 3) position on the polycube of each vertex of the hexes
    alpha : distance equivalent to opposite normals, in diagonals
    """
    goal = target(surface)
    triangles = hexes.quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    corners = goal.to_unit(hexes.vertices)[triangles]
    tree = closest.tree(corners, unit(triangle_vectors(corners)))
    _, face, weight = closest.closest(tree, goal.surface.vertices, goal.vertex_normals, alpha)
    return Parametrization(np.einsum("vk,vkd->vd", weight, positions[triangles[face]]))
