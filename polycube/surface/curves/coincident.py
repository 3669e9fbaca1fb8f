"""Curves and corners of a surface that lie on others, for all that a mesh can tell.

Faces narrower than the tolerance have them: a step of a hundredth of a millimetre, two bores of
nearly the same diameter.  One path of mesh edges serves both curves; two would cross each other.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from polycube.surface.curves.features import Features

NEAR = 0.001  # of the diagonal: a third of what a curve may be off
STEP = 0.004  # between the samples of a curve


@lru_cache(maxsize=4)
def merged(features: Features) -> np.ndarray:
    """(C,) number of the corner that stands for each: the first of those within `NEAR`."""
    found = np.arange(len(features.corners))
    for number, corner in enumerate(features.corners):
        gap = np.linalg.norm(features.corners[:number] - corner, axis=1)
        near = np.flatnonzero((gap <= NEAR) & (found[:number] == np.arange(number)))
        if len(near):
            found[number] = near[0]
    return found


@lru_cache(maxsize=4)
def covered(features: Features) -> np.ndarray:
    """(C,) whether all of a curve is within `NEAR` of longer curves that are not covered."""
    creases = features.creases
    boxes = [(c.points.min(axis=0) - NEAR, c.points.max(axis=0) + NEAR) for c in creases]
    found = np.zeros(len(creases), bool)
    kept: list[int] = []
    for number in sorted(range(len(creases)), key=lambda k: -creases[k].length):
        crease, (low, high) = creases[number], boxes[number]
        places = crease.at(np.linspace(0, crease.length, 5 + int(crease.length / STEP)))[0]
        gap = np.full(len(places), np.inf)
        for other in kept:
            if (boxes[other][0] <= high).all() and (boxes[other][1] >= low).all():
                gap = np.minimum(gap, creases[other].nearest(places)[1])
        found[number] = (gap <= NEAR).all()
        if not found[number]:
            kept.append(number)
    return found
