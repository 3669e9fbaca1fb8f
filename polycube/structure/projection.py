"""A surface on its polycube: positions of vertices, projections, and labels of triangles."""

import logging
from collections.abc import Sequence

import numpy as np

from polycube.structure.lattice import Boundary, boundary, cell_and_wall
from polycube.surface import closest
from polycube.surface.fit_target import target
from polycube.surface.measures import triangle_vectors, twins, unit
from polycube.types import HexMesh, Labels, Parametrization, Polycube, TriMesh

# Distance in cells equivalent to a label that is e times as probable. Determined on 96 pairs
# outside the training and held-out sets: 86.6 % of the points in the correct patch at 0, 88.0 at
# 0.1, 88.1 from 0.15 to 0.5, 88.0 for labels alone.
TRUST = 0.2
logger = logging.getLogger(__name__)


def project(
    polycube: Polycube, points: np.ndarray, log_labels: Sequence[np.ndarray] = ()
) -> tuple[np.ndarray, np.ndarray]:
    """Closest points (N, 3) on the boundary to points (N, 3), and the labels (N,) of their faces.

    log_labels : log-probabilities of the axis of the face (N, 6), of its cell (N, cells) and of its
        being a face of a hole (N, 2), see `Denoised.log_labels`. With them, the face minimises the
        distance minus TRUST times the log-probability, and the polycube must have all knots of
        `lattice`
    """
    surface = boundary(polycube)
    cost = -TRUST * log_probability(polycube, surface, log_labels) if len(log_labels) else 0.0
    placed, face = project_onto(surface, points, cost)
    return placed, surface.axis[face]


def project_onto(
    surface: Boundary, points: np.ndarray, cost: np.ndarray | float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Closest points (N, 3) on the faces that minimise distance plus cost (N, Q), and faces (N,).

    The faces are axis-aligned rectangles, so the closest point is found by clipping coordinates.
    """
    corners = surface.vertices[surface.quads]  # (Q, 4, 3)
    on_faces = np.clip(points[:, None], corners.min(axis=1), corners.max(axis=1))  # (N, Q, 3)
    face = (np.linalg.norm(on_faces - points[:, None], axis=2) + cost).argmin(axis=1)
    return on_faces[np.arange(len(points)), face], face


def log_probability(
    polycube: Polycube, surface: Boundary, log_labels: Sequence[np.ndarray]
) -> np.ndarray:
    """(N, Q) log-probability of each boundary face: the sum for its axis, cell and wall."""
    labels = (surface.axis, *cell_and_wall(polycube, surface))
    of_label = [log_p[:, label] for log_p, label in zip(log_labels, labels, strict=True)]
    return np.sum(of_label, axis=0)


def nearest_labels(
    surface: TriMesh,
    polycube: Polycube,
    parametrization: Parametrization,
    alpha: float = 0.3,
    rounds: int = 5,
) -> Labels:
    """Label each triangle with the polycube face closest to its image on the polycube.

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
