"""More parts where the surface curves: how far the middles of mesh edges are from it.

An edge of length h lies h^2 / 8 R off a curve of radius R.  Measured on a coarse mesh that has been
registered, that tells how many parts an interval of the lattice needs.
"""

from __future__ import annotations

import numpy as np

from polycube.hexmesh.generation.sizing import Counts, number_of_hexes
from polycube.hexmesh.generation.template import mesh
from polycube.structure.rough_map import identity_map
from polycube.surface.fit_target import Target
from polycube.types import HexMesh, PerAxis, Polycube

SHARE = 75  # per cent of the edges of a polycube face, in an interval, that are to be near
SPARED = 0.05  # of a part that may be lacking
MOST = 2  # times the parts that the size asks for, in an interval and as hexes
RELAX = 1.1  # of the distance, until the hexes are not too many


def gaps(polycube: Polycube, hexes: HexMesh, counts: Counts, goal: Target) -> PerAxis:
    """How far edges along each axis are off the surface in each interval, in diagonals.

    hexes : `template.mesh` with so many parts of each interval, registered

    The polycube face that is worst counts, by what 75 % of its edges keep: a small hole asks for
    more although its slab is flat elsewhere.  What the ends are off is taken away.
    """
    ends = np.stack([hexes.quads, np.roll(hexes.quads, -1, axis=1)], axis=-1).reshape(-1, 2)
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
    polycube: Polycube,
    counts: Counts,
    measured: Counts,
    gap: PerAxis,
    wanted: float,
) -> Counts:
    """The counts raised until edges are within `wanted` (diagonals) of the surface, by h^2.

    measured : the parts that the gaps belong to

    No interval gets more than twice its parts, and the distance is relaxed until there are no
    more than twice the hexes.
    """
    most = MOST * number_of_hexes(polycube, counts)
    while True:
        needed = [m * np.sqrt(g / wanted) - SPARED for m, g in zip(measured, gap, strict=True)]
        x, y, z = (
            np.clip(np.ceil(n), c, MOST * c).astype(int)
            for n, c in zip(needed, counts, strict=True)
        )
        if number_of_hexes(polycube, (x, y, z)) <= most:
            return x, y, z
        wanted *= RELAX
