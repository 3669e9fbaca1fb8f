"""Nearest points of a polycube's boundary."""

from __future__ import annotations

import numpy as np

from polycube.geometry.lattice import boundary
from polycube.types import Polycube


def project(polycube: Polycube, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) of the boundary nearest to (N, 3) points, and the labels (N,) of their faces.

    The faces are axis-aligned rectangles, so the nearest point of each is a clip.
    """
    surface = boundary(polycube)
    corners = surface.vertices[surface.quads]  # (Q, 4, 3)
    on_faces = np.clip(points[:, None], corners.min(axis=1), corners.max(axis=1))  # (N, Q, 3)
    nearest = ((on_faces - points[:, None]) ** 2).sum(axis=2).argmin(axis=1)
    return on_faces[np.arange(len(points)), nearest], surface.axis[nearest]
