"""Labels of a surface: the polycube face to which each triangle is mapped."""

import logging

import numpy as np

from polycube.structure.lattice import boundary
from polycube.surface import closest
from polycube.surface.measures import triangle_vectors, twins, unit
from polycube.types import Labels, Parametrization, Polycube, TriMesh

logger = logging.getLogger(__name__)


def nearest_labels(
    surface: TriMesh,
    polycube: Polycube,
    parametrization: Parametrization,
    alpha: float = 0.3,
    rounds: int = 5,
) -> Labels:
    """Label each triangle with the polycube face closest to its image on the polycube.

    Parameters
    ----------
    alpha : distance equivalent to opposite normals, in cells
    rounds : rounds of the majority vote that removes isolated triangles
    """
    outside = boundary(polycube)
    corners = outside.vertices[outside.quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)]
    tree = closest.tree(corners, unit(triangle_vectors(corners)))
    placed = parametrization.positions[surface.faces]  # (F, 3, 3)
    normals = unit(triangle_vectors(placed))
    _, nearest, _ = closest.closest(tree, placed.mean(axis=1), normals, alpha)
    patch = majority(outside.patch[nearest // 2], surface.faces, rounds)
    n_used, axis = len(np.unique(patch)), outside.patch_axis
    logger.info("labels: %d of %d polycube faces on the surface", n_used, len(axis))
    return Labels(axis[patch], patch)


def majority(patch: np.ndarray, faces: np.ndarray, rounds: int) -> np.ndarray:
    """Labels (F,) after rounds in which an isolated triangle takes the label of two neighbours."""
    first, second = twins(faces)
    across = np.empty(faces.size, np.int64)  # face on the other side of each half-edge
    across[first], across[second] = second // 3, first // 3
    neighbour = across.reshape(-1, 3)
    for _ in range(rounds):
        around = patch[neighbour]
        a, b, c = around.T
        winner = np.where((a == b) | (a == c), a, b)
        is_isolated = ((a == b) | (a == c) | (b == c)) & (around != patch[:, None]).all(axis=1)
        if not is_isolated.any():
            break
        patch = np.where(is_isolated, winner, patch)
    return patch
