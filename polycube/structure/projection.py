"""Projection of points onto the boundary of a polycube, by distance and optionally by labels."""

from collections.abc import Sequence

import numpy as np

from polycube.structure.lattice import Boundary, boundary, cell_and_wall
from polycube.types import Polycube

# Distance in cells equivalent to a label that is e times as probable. Determined on 96 pairs
# outside the training and held-out sets: 86.6 % of the points in the correct patch at 0, 88.0 at
# 0.1, 88.1 from 0.15 to 0.5, 88.0 for labels alone.
TRUST = 0.2


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
