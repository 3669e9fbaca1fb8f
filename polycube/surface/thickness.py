"""Thickness of a solid at points of its surface.

A sphere starts at the point and grows into the solid: in each step its centre moves away from the
closest point of the surface by a fraction of the radius. It stops between two opposite walls, when
the directions from the centre to two successive closest points differ by more than about 140
degrees. The distance between these two points is the thickness.

The chord along the inward normal and the largest sphere that touches the surface at the point do
not measure the wall at an edge: on the rim of a plate the chord is as long as the plate, and a
sphere that touches the surface next to a convex edge has no size. The moving sphere leaves the edge
along the bisector until the two faces of the plate stop it.
"""

import numpy as np

from polycube.surface.fit_target import Target, target
from polycube.types import TriMesh

OPPOSITE = -0.8  # largest cosine between the directions to opposite walls
START = 2e-4  # of the diagonal: first distance from the surface, less than half of any wall
STEP = 0.5  # of the radius: distance that the centre moves in a step
STEPS = 100  # three steps at a corner of three faces increase the radius by half


def thickness(surface: TriMesh, points: np.ndarray) -> np.ndarray:
    """Measure the thickness of a solid at points of its surface.

    Parameters
    ----------
    surface : TriMesh
        Closed surface of the solid.
    points : (N, 3) array
        Points on or near the surface, in model units.

    Returns
    -------
    (N,) array
        Distance between the two walls around each point in model units: the thickness of a plate,
        the wall of a tube, the diameter of a ball. At most the diagonal.
    """
    goal = target(surface)
    return goal.scale * widths(goal, goal.to_unit(points))


def widths(
    goal: Target, points: np.ndarray, outside: bool = False, most: float = np.inf
) -> np.ndarray:
    """Thickness at points of a prepared surface; points and lengths at unit scale.

    outside : the sphere grows outside the solid, which gives the width of a slot or the diameter of
        a hole
    most : largest diameter of a sphere; larger values are cut off
    """
    foot, face = goal.closest(points)
    inside = goal.surface.vertices[goal.surface.faces[face]].mean(axis=1) - foot
    length = np.linalg.norm(inside, axis=1, keepdims=True)
    # away from edges and corners
    foot = foot + inside * np.minimum(1, START / np.maximum(length, 1e-30))
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
