"""What the fitting stages compare meshes by: the worst hex, less what misses the surface.

The acceptance of a run is another matter: see the plugins of kind `acceptance`.
"""

from __future__ import annotations

from polycube.hexmesh.inspection import Inspection

FULL = 0.6  # a scaled Jacobian counts in full up to this
BEYOND = 0.25  # what a scaled Jacobian counts beyond that
CREASES = 0.003  # of the diagonal: 5 % of the creases may be as far from the mesh's edges
INVALID = 1e6  # what an inverted hex costs: any valid mesh is better
LEAST = 0.41  # scaled Jacobian that a finer mesh must keep
KEPT = 0.9  # share of the coarse mesh's scaled Jacobian that is enough where that is less
# beyond one of these limits a mesh misses the surface
OFF_SURFACE = 0.005  # of the diagonal, for boundary vertices
APART = 0.045  # of the diagonal, for all sampled points, both ways
VOLUME_OFF = 0.04  # of the surface's volume
POOR = 0.2  # scaled Jacobian


def merit_of(jacobian: float, vertices: float, creases: float, near: float = CREASES) -> float:
    """Merit of a worst hex, and of boundary vertices and creases that miss; larger is better.

    Parameters
    ----------
    jacobian : smallest scaled Jacobian
    vertices, creases : distances in diagonals
    near : distance of the creases that costs nothing
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

    The vertices may miss by 0.1 % of the diagonal, 99 % of the points by 1 %, 95 % of the creases
    by 0.3 % and the volume by 3 % at no cost.
    """
    apart = found.deviation
    miss = max(apart.to_surface.p99, apart.to_mesh.p99)
    return (
        merit_of(found.scaled_jacobian, apart.vertices, found.creases)
        - 5 * max(0, miss - 0.01)
        - 4 * max(0, abs(found.volume_ratio - 1) - 0.03)
    )


def misses(found: Inspection) -> int:
    """Number of limits that a mesh is beyond."""
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
    """Scaled Jacobian that a finer mesh must keep where the coarse one has this."""
    return min(LEAST, KEPT * coarse)
