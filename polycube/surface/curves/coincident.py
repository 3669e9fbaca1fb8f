"""Curves and corners of a surface that coincide with others within the tolerance of a mesh.

They belong to faces narrower than the tolerance, such as a step of a hundredth of a millimetre or
two bores of nearly the same diameter. One path of mesh edges represents both curves, because two
paths would cross each other.
"""

from functools import lru_cache

import numpy as np

from polycube.surface.curves.features import Features

NEAR = 0.001  # of the diagonal: a third of the permitted distance of a curve
STEP = 0.004  # spacing of the sample points of a curve


@lru_cache(maxsize=4)
def merged(features: Features) -> np.ndarray:
    """(C,) representative of each corner: the first corner within `NEAR`."""
    found = np.arange(len(features.corners))
    for number, corner in enumerate(features.corners):
        gap = np.linalg.norm(features.corners[:number] - corner, axis=1)
        near = np.flatnonzero((gap <= NEAR) & (found[:number] == np.arange(number)))
        if len(near):
            found[number] = near[0]
    return found


@lru_cache(maxsize=4)
def covered(features: Features) -> np.ndarray:
    """(C,) whether a curve is entirely within `NEAR` of longer curves that are not covered."""
    creases = features.creases
    boxes = [(c.points.min(axis=0) - NEAR, c.points.max(axis=0) + NEAR) for c in creases]
    found = np.zeros(len(creases), bool)
    longer: list[int] = []
    for number in sorted(range(len(creases)), key=lambda k: -creases[k].length):
        crease, (low, high) = creases[number], boxes[number]
        places = crease.at(np.linspace(0, crease.length, 5 + int(crease.length / STEP)))[0]
        gap = np.full(len(places), np.inf)
        for other in longer:
            if (boxes[other][0] <= high).all() and (boxes[other][1] >= low).all():
                gap = np.minimum(gap, creases[other].nearest(places)[1])
        found[number] = (gap <= NEAR).all()
        if not found[number]:
            longer.append(number)
    return found
