"""More parts in curved regions, from the distance of the midpoints of mesh edges.

The midpoint of an edge of length h is h^2 / 8 R away from a curve of radius R. This distance is
measured on a registered coarse mesh and gives the required number of parts of each interval.
"""

import numpy as np

from polycube.hexmesh.generation.sizing import Counts, number_of_hexes
from polycube.hexmesh.generation.template import mesh
from polycube.structure.rough_map import identity_map
from polycube.surface.fit_target import Target
from polycube.surface.measures import half_edges
from polycube.types import HexMesh, PerAxis, Polycube

SHARE = 75  # per cent of the edges of a polycube face in an interval that must be close
SHORTFALL = 0.05  # permitted shortfall, in parts
MOST = 2  # largest factor for the parts of an interval and for the number of hexes
RELAX = 1.1  # factor by which the distance is increased until the number of hexes is permitted


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
    most = MOST * number_of_hexes(polycube, counts)
    while True:
        needed = [m * np.sqrt(g / wanted) - SHORTFALL for m, g in zip(measured, gap, strict=True)]
        x, y, z = (
            np.clip(np.ceil(n), c, MOST * c).astype(int)
            for n, c in zip(needed, counts, strict=True)
        )
        if number_of_hexes(polycube, (x, y, z)) <= most:
            return x, y, z
        wanted *= RELAX
