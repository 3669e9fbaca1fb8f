"""More parts of a lattice in curved regions and along sharp edges, to reduce their chord error.

In curved regions: the midpoint of an edge of length h is h^2 / 8 R away from a curve of radius R.
This distance is measured on a registered coarse mesh and gives the required number of parts of each
interval. Along sharp edges: the paths of the creases on a coarse mesh give the intervals of the
lattice along each crease.
"""

from collections.abc import Callable
from functools import cache, partial

import numpy as np

from polycube.fitting.creases.constraints import match
from polycube.fitting.problem import FitProblem
from polycube.hexmesh.generation.interval_counts import Demand, Lattice, raised
from polycube.hexmesh.generation.sizing import Counts, number_of_hexes
from polycube.hexmesh.generation.template import mesh
from polycube.structure.rough_map import identity_map
from polycube.surface.curves.features import Crease
from polycube.surface.fit_target import Target
from polycube.surface.measures import half_edges
from polycube.types import HexMesh, PerAxis, Polycube

EDGES = 2  # largest factor for the number of edges of a crease
HEXES = 1.5  # largest factor for the number of hexes
RELAX = 1.1  # factor by which the distance is increased until the number of hexes is permitted
SAMPLES = 16  # points on the crease for every chord
MOST = 95  # per cent of the points that are within the given distance
SHARE = 75  # per cent of the edges of a polycube face in an interval that must be close
SHORTFALL = 0.05  # permitted shortfall, in parts
DOUBLED = 2  # largest factor for the parts of an interval and for the number of hexes


def gaps(polycube: Polycube, hexes: HexMesh, counts: Counts, goal: Target) -> PerAxis:
    """Distance of edges along each axis from the surface, for each interval, in diagonals.

    hexes : registered mesh of `template.mesh` with the given parts of each interval

    The value of the worst polycube face counts, namely the distance that 75 % of its edges do not
    exceed, so that a small hole is resolved in an otherwise flat slab. The distance of the end
    points is subtracted.
    """
    ends = half_edges(hexes.quads)
    patch = np.repeat(hexes.patch, 4)
    places = goal.to_unit(hexes.vertices)
    middle = places[ends].mean(axis=1)
    off = np.linalg.norm(places - goal.closest(places)[0], axis=1)
    gap = np.linalg.norm(middle - goal.closest(middle)[0], axis=1) - off[ends].mean(axis=1)
    where = mesh(polycube, identity_map(polycube), counts).vertices
    axis = np.abs(where[ends[:, 1]] - where[ends[:, 0]]).argmax(axis=1)
    where = where[ends].mean(axis=1)
    found = [np.zeros(len(number)) for number in counts]
    for a, knots in enumerate(polycube.knots):
        slab = np.searchsorted(knots, where[:, a]) - 1
        for name in np.unique(np.stack([slab, patch], axis=1)[axis == a], axis=0):
            here = (axis == a) & (slab == name[0]) & (patch == name[1])
            found[a][name[0]] = max(found[a][name[0]], np.percentile(gap[here], SHARE))
    return found[0], found[1], found[2]


def finer(
    polycube: Polycube, counts: Counts, measured: Counts, gap: PerAxis, wanted: float
) -> Counts:
    """Counts that bring edges within `wanted` (diagonals) of the surface; the gap is of order h^2.

    measured : the parts to which the gaps belong

    The parts of an interval are at most doubled. The permitted distance is increased until the
    number of hexes is at most doubled.
    """
    most = DOUBLED * number_of_hexes(polycube, counts)
    while True:
        needed = [m * np.sqrt(g / wanted) - SHORTFALL for m, g in zip(measured, gap, strict=True)]
        both = zip(needed, counts, strict=True)
        x, y, z = (np.clip(np.ceil(n), c, DOUBLED * c).astype(int) for n, c in both)
        if number_of_hexes(polycube, (x, y, z)) <= most:
            return x, y, z
        wanted *= RELAX


def finer_along(
    lattice: Lattice, counts: Counts, goal: Target, wanted: float, max_hexes: int
) -> Counts:
    """Counts with which even chords of each crease are within a distance for 95 % of its length.

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
    return float(np.percentile(np.linalg.norm(apart - share[:, :, None] * chord, axis=2), MOST))


def chords_needed(error: Callable[[int], float], wanted: float, least: int, most: int) -> int:
    """The smallest number of chords, from `least` to `most`, that are within a distance.

    If no number meets the distance: the number with the smallest error.

    error : distance for a number of chords, as `chord_error` gives it
    """
    errors: dict[int, float] = {}
    for number in range(least, most + 1):
        errors[number] = error(number)
        if errors[number] <= wanted:
            return number
    return min(errors, key=lambda number: errors[number])
