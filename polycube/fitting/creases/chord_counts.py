"""More parts of a lattice along the sharp edges of the surface, to reduce their chord error.

The paths of the creases on a coarse mesh give the intervals of the lattice along each crease.
"""

from collections.abc import Callable
from functools import cache, partial

import numpy as np

from polycube.fitting.creases.constraints import match
from polycube.fitting.problem import FitProblem
from polycube.hexmesh.generation.interval_counts import Demand, Lattice, raised
from polycube.hexmesh.generation.sizing import Counts, number_of_hexes
from polycube.surface.curves.features import Crease
from polycube.surface.fit_target import Target

EDGES = 2  # largest factor for the number of edges of a crease
HEXES = 1.5  # largest factor for the number of hexes
RELAX = 1.1  # factor by which the distance is increased until the number of hexes is permitted
SAMPLES = 16  # points on the crease for every chord
MOST = 95  # per cent of the points that are within the given distance


def finer_along(
    lattice: Lattice, counts: Counts, goal: Target, wanted: float, max_hexes: int
) -> Counts:
    """Counts with which even chords of each crease are within a distance for 95 % of its length.

    Parameters
    ----------
    wanted : distance in diagonals; it is increased until the number of hexes grows by at most a
        half, and is at most `max_hexes`
    """
    polycube, near, parts = lattice.polycube, lattice.near, np.concatenate(counts)
    routes = match(FitProblem(near, goal, samples=1), goal.to_unit(near.vertices)).routes
    along = [(r.crease, lattice.demand(r.sides, len(r.sides))) for r in routes]
    errors = [cache(partial(chord_error, crease)) for crease, _ in along]
    before = number_of_hexes(polycube, counts)
    most = max(before, min(max_hexes, HEXES * before))
    while True:
        demands, is_finer = [], False
        for (crease, path), error in zip(along, errors, strict=True):
            now = max(3 if crease.is_loop else 1, round(path.times @ parts))
            number = chords_needed(error, wanted, now, EDGES * now)
            is_finer |= number > now
            demands.append(Demand(path.times, path.length, number))
        found = raised(polycube, counts, demands, max_hexes)
        if number_of_hexes(polycube, found) <= most:
            return found
        if not is_finer:  # a larger distance changes nothing
            return counts
        wanted *= RELAX


def chord_error(crease: Crease, number: int) -> float:
    """Distance that contains 95 % of a crease, for chords of equal arc length.

    number : number of chords, at least 1; at least 3 for a loop
    """
    ends = crease.at(np.linspace(0, crease.length, number + 1)[:-1])[0]
    last = ends[0] if crease.is_loop else crease.at(np.array([crease.length]))[0][0]
    chord = np.diff(np.vstack([ends, last]), axis=0)[:, None]
    arc = crease.length / number * (np.arange(number * SAMPLES) + 0.5) / SAMPLES
    apart = crease.at(arc)[0].reshape(number, SAMPLES, 3) - ends[:, None]
    square = np.maximum((chord * chord).sum(axis=2), 1e-30)
    share = np.clip((apart * chord).sum(axis=2) / square, 0, 1)
    gaps = np.linalg.norm(apart - share[:, :, None] * chord, axis=2)
    return float(np.percentile(gaps, MOST))


def chords_needed(error: Callable[[int], float], wanted: float, least: int, most: int) -> int:
    """The smallest number of chords, from `least` to `most`, that are within a distance.

    If no number meets the distance: the number with the smallest error.

    Parameters
    ----------
    error : distance for a number of chords, as `chord_error` gives it
    """
    numbers = range(least, most + 1)
    errors = []
    for number in numbers:
        errors.append(error(number))
        if errors[-1] <= wanted:
            return number
    return numbers[int(np.argmin(errors))]
