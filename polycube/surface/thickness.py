"""Thickness of a solid at points of its surface.

A sphere starts at the point and grows into the solid: its centre moves away from the closest point
of the surface, a fraction of the radius at a time.  It stops between two opposite walls: where the
directions from the centre to two successive closest points differ by more than about 140 degrees.
The distance of these two points is the thickness.

Neither the chord along the inward normal nor the largest sphere that touches the surface at the
point is used, because neither measures the wall at an edge: on the rim of a plate the chord is as
long as the plate, and a sphere that touches the surface beside a convex edge has no size.  The
moving sphere slides off the edge, along the bisector, until the two faces of the plate stop it.
"""

from __future__ import annotations

import numpy as np

from polycube.surface.fit_target import Target, target
from polycube.types import TriMesh

OPPOSITE = -0.8  # largest cosine between the directions to opposite walls
START = 2e-4  # of the diagonal: first distance from the surface, less than half of any wall
STEP = 0.5  # of the radius: how far the centre moves at a time
STEPS = 100  # at a corner of three faces, three of them make the radius half as large again


def thickness(
    surface: TriMesh, points: np.ndarray, outside: bool = False, most: float = np.inf
) -> np.ndarray:
    """Measure the thickness of a solid at points of its surface, or the room outside it.

    Parameters
    ----------
    surface : TriMesh
        Closed surface of the solid.
    points : (N, 3) array
        Points on the surface or near it, in the surface's coordinates.
    outside : bool
        Whether the sphere grows out of the solid: the width of a slot, the diameter of a hole.
    most : float
        Diameter, in the surface's units, at which a sphere stops growing; it is its answer.

    Returns
    -------
    (N,) array
        Distance between the two walls around each point, in the surface's units: the thickness of a
        plate, the wall of a tube, the diameter of a ball.  At most the diagonal.
    """
    goal = target(surface)
    return goal.scale * widths(goal, goal.to_unit(points), outside, most / goal.scale)


def widths(
    goal: Target, points: np.ndarray, outside: bool = False, most: float = np.inf
) -> np.ndarray:
    """The same of a prepared surface; points and lengths at unit scale."""
    foot, face = goal.closest(points)
    inside = goal.surface.vertices[goal.surface.faces[face]].mean(axis=1) - foot
    length = np.linalg.norm(inside, axis=1, keepdims=True)
    foot = foot + inside * np.minimum(1, START / np.maximum(length, 1e-30))  # off edges and corners
    way = START if outside else -START
    centre, before = foot + way * goal.normals[face], foot
    found, active = np.ones(len(points)), np.arange(len(points))
    for _ in range(STEPS):
        foot, face = goal.closest(centre, guess=face)
        away, back = centre - foot, before - centre
        radius = np.linalg.norm(away, axis=1)
        found[active] = 2 * radius
        cosine = -(away * back).sum(axis=1) / np.maximum(
            radius * np.linalg.norm(back, axis=1), 1e-30
        )
        stopped = cosine < OPPOSITE
        found[active[stopped]] = np.linalg.norm(foot - before, axis=1)[stopped]
        stopped |= 2 * radius > most
        active, face, before = active[~stopped], face[~stopped], foot[~stopped]
        centre = (centre + STEP * away)[~stopped]
    return np.where(found > 0, np.minimum(found, 1), 1)
