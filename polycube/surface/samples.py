"""Evenly distributed points on a surface."""

import numpy as np

from polycube.surface.measures import face_areas
from polycube.types import TriMesh


def spread(surface: TriMesh, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) distributed evenly by area, and their faces (N,).

    Faces are chosen in steps of equal area; positions within a face come from a fixed generator.
    """
    area = np.cumsum(face_areas(surface))
    step = (np.arange(number) + 0.381966) / number * area[-1]
    face = np.minimum(np.searchsorted(area, step), len(area) - 1)
    root, share = np.random.default_rng(0).random((2, number, 1))
    root = np.sqrt(root)
    a, b, c = np.moveaxis(surface.vertices[surface.faces[face]], 1, 0)
    return (1 - root) * a + root * (1 - share) * b + root * share * c, face
