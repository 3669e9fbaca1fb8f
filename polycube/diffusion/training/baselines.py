"""What can be had without a network: baselines beside the measured networks, given the context."""

import numpy as np

from polycube.structure.lattice import OUTWARD, Boundary
from polycube.structure.projection import project_onto

LOOK = 0.3  # cells equivalent to a face perpendicular to the surface


def baselines(
    surface: Boundary, geometry: np.ndarray, normals: np.ndarray
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Positions (N, 3) and faces (N,) of each baseline, by its name.

    untouched: the geometry itself, and the nearest faces; box: the geometry with its box on that of
    the polycube; normals: this on the nearest faces that look the same way; centre: one point for
    all, the centre of the polycube.

    surface : boundary of the polycube; geometry, normals : (N, 3) in its coordinates
    """
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    share = (geometry - geometry.min(axis=0)) / np.ptp(geometry, axis=0)
    boxed = low + share * (high - low)
    away = LOOK * (1 - normals @ OUTWARD[surface.axis].T)  # (N, Q)
    middle = np.broadcast_to((low + high) / 2, geometry.shape)
    return {
        "untouched": (geometry, project_onto(surface, geometry)[1]),
        "box": (boxed, project_onto(surface, boxed)[1]),
        "normals": project_onto(surface, boxed, away),
        "centre": (middle, project_onto(surface, middle)[1]),
    }
