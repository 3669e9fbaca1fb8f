"""Comparison of meshes in the fitting stages: worst hex, minus deviations from the surface.

The acceptance of a run is defined by the plugins of kind `acceptance`.
"""

from polycube.hexmesh.inspection import Inspection
from polycube.types import Goal

FULL = Goal.smooth_jacobian  # the scaled Jacobian counts in full up to this value
BEYOND = 0.25  # weight of the scaled Jacobian above it
# of the diagonal: distance from mesh edges that 5 % of the creases may exceed
CREASES = Goal.features
INVALID = 1e6  # penalty of an inverted hex: any valid mesh is better
LEAST = 0.41  # smallest scaled Jacobian of a refined mesh
# smallest share of the scaled Jacobian of the coarse mesh, if that is less than LEAST
RELATIVE_LEAST = 0.9
# a mesh that exceeds one of these limits does not fit the surface
OFF_SURFACE = Goal.far_vertices  # of the diagonal, for boundary vertices
APART = 0.045  # of the diagonal, for all sample points in both directions
VOLUME_OFF = Goal.far_volume  # of the volume of the surface
POOR = Goal.poor_jacobian  # scaled Jacobian


def merit_of(jacobian: float, vertices: float, creases: float, near: float = CREASES) -> float:
    """Merit of a worst hex, and of boundary vertices and creases; larger is better.

    Parameters
    ----------
    jacobian : smallest scaled Jacobian
    vertices, creases : distances in diagonals
    near : distance of the creases without penalty
    """
    return (
        min(jacobian, FULL)
        + BEYOND * max(0, jacobian - FULL)
        - INVALID * (jacobian <= 0)
        - 20 * max(0, vertices - 0.001)
        - 5 * max(0, creases - near)
    )


def merit(found: Inspection) -> float:
    """Merit of a mesh; larger is better.

    There is no penalty for distances of up to 0.1 % of the diagonal for the vertices, 1 % for 99 %
    of the points, 0.3 % for 95 % of the creases, and 3 % for the volume.
    """
    apart = found.deviation
    return (
        merit_of(found.scaled_jacobian, apart.vertices, found.creases)
        - 5 * max(0, apart.p99 - Goal.distance)
        - 4 * max(0, abs(found.volume_ratio - 1) - 0.03)
    )


def exceeded_limits(found: Inspection) -> int:
    """Number of limits that a mesh exceeds."""
    apart = found.deviation
    farthest = max(apart.to_surface.largest, apart.to_mesh.largest)
    return sum(
        [
            found.scaled_jacobian < POOR,
            apart.vertices >= OFF_SURFACE,
            farthest >= APART,
            abs(found.volume_ratio - 1) >= VOLUME_OFF,
        ]
    )


def least_jacobian(coarse: float) -> float:
    """Smallest scaled Jacobian of a refined mesh, from that of the coarse mesh."""
    return min(LEAST, RELATIVE_LEAST * coarse)
