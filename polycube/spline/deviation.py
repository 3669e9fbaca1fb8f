"""How far the boundary of a spline and the surface it stands for are apart, both ways."""

from __future__ import annotations

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

PIECES = 4  # cuts of a boundary face each way
SAMPLES = 8000  # points on the surface, besides its vertices


@dataclass(frozen=True)
class Deviation:
    """Distances are fractions of the surface's diagonal."""

    to_surface: Distances  # from points of the spline's boundary
    to_spline: Distances  # from points of the surface
    worst: tuple[float, float, float]  # place on either, farthest from the other
    volume: float  # the spline's over the surface's, less 1


@lru_cache(maxsize=4)
def deviation(spline: Spline, surface: TriMesh) -> Deviation:
    """Of 25 points on each boundary face, and of samples and vertices of the surface.

    These are measured to chords of the spline, which are a 16th of a face's own sagitta inside.
    Kept, for plugin and report ask alike.
    """
    goal = target(surface)
    points, _, _ = sampling(spline, *grid(np.arange(PIECES + 1) / PIECES))
    own = goal.to_unit(points @ (spline.extraction @ spline.control))
    there = closest.distance(goal.tree, own)
    faces = triangles(own, PIECES)
    others = np.concatenate([goal.samples(SAMPLES)[0], goal.surface.vertices])
    here = closest.distance(closest.tree(faces, np.zeros((len(faces), 3))), others)
    both, places = np.concatenate([there, here]), np.concatenate([own, others])
    return Deviation(
        Distances.of(there),
        Distances.of(here),
        tuple(goal.to_model(places[both.argmax()]).tolist()),
        min_detj(spline).volume / volume(surface) - 1,
    )
