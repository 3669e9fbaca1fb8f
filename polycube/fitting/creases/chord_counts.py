"""More parts of a lattice along the sharp edges of the surface, for chords that are near them.

The paths of the creases on a coarse mesh show which intervals of the lattice lie along each.
"""

from __future__ import annotations

import numpy as np

from polycube.fitting.creases.constraints import match
from polycube.fitting.problem import FitProblem
from polycube.hexmesh.generation.interval_counts import Demand, Lattice, raised
from polycube.hexmesh.generation.sizing import Counts, number_of_hexes
from polycube.surface.curves.chords import chords_needed
from polycube.surface.fit_target import Target
from polycube.types import HexMesh, Polycube

EDGES = 2  # times the edges that a crease has without, at most
HEXES = 1.5  # times the hexes, at most
RELAX = 1.1  # of the distance, until the hexes are not too many


def finer_along(
    polycube: Polycube,
    counts: Counts,
    near: HexMesh,
    measured: Counts,
    goal: Target,
    wanted: float,
    max_hexes: int,
) -> Counts:
    """The counts raised until even chords of each crease are within a distance for 95 % of it.

    Parameters
    ----------
    near : `template.mesh` with so many parts as `measured`, registered
    wanted : distance in diagonals; it is relaxed until there are no more than half as many hexes
        again, and no more than `max_hexes`
    """
    routes = match(FitProblem(near, goal, samples=1), goal.to_unit(near.vertices)).routes
    lattice, parts = Lattice(polycube, near, measured), np.concatenate(counts)
    along = [(route.crease, lattice.along_path(route.sides)) for route in routes]
    before = number_of_hexes(polycube, counts)
    most = max(before, min(max_hexes, HEXES * before))
    while True:
        demands = []
        for crease, path in along:
            now = max(3 if crease.is_loop else 1, round(path.times @ parts))
            number = chords_needed(crease, wanted, now, EDGES * now)
            demands.append(Demand(path.times, path.length, number))
        found = raised(polycube, counts, demands, max_hexes)
        if number_of_hexes(polycube, found) <= most:
            return found
        wanted *= RELAX
