"""Distances between the boundary of a spline and its surface, in both directions."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from polycube.hexmesh.quality import Distances
from polycube.spline.bezier import min_detj
from polycube.spline.boundary import grid, sampling, triangles
from polycube.surface import closest
from polycube.surface.fit_target import target
from polycube.surface.measures import volume
from polycube.types import Spline, TriMesh

PIECES = 4  # divisions of a boundary face in each direction
SAMPLES = 8000  # points on the surface, in addition to its vertices


@dataclass(frozen=True)
class Deviation:
    """Distances as fractions of the diagonal of the surface."""

    to_surface: Distances  # from points of the boundary of the spline
    to_spline: Distances  # from points of the surface
    worst: tuple[float, float, float]  # point with the largest distance, on either
    volume: float  # volume of the spline divided by that of the surface, minus 1


@lru_cache(maxsize=4)
def deviation(spline: Spline, surface: TriMesh) -> Deviation:
    """Deviation at 25 points of each boundary face, and at samples and vertices of the surface.

    Distances of the latter are measured to chords of the spline, whose error is a 16th of the
    sagitta of a face. The result is cached for the plugin and the report.
    """
    goal = target(surface)
    points, _, _ = sampling(spline, *grid(np.arange(PIECES + 1) / PIECES))
    own = goal.to_unit(points @ (spline.extraction @ spline.control))
    there = closest.distance(goal.tree, own)
    faces = triangles(own, PIECES)
    others = np.concatenate([goal.samples(SAMPLES)[0], goal.surface.vertices])
    here = closest.distance(closest.tree(faces), others)
    both, places = np.concatenate([there, here]), np.concatenate([own, others])
    return Deviation(
        Distances.of(there),
        Distances.of(here),
        tuple(goal.to_model(places[both.argmax()]).tolist()),
        min_detj(spline).volume / volume(surface) - 1,
    )
