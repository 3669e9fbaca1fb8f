"""A common path of mesh edges for curves that leave a corner in nearly the same direction.

Where a CAD face ends in a cusp, its two borders stay within the tolerance of features for more than
the length of a hex. Two separate paths would make quads with an angle as small as that of the cusp.
One path between the two curves ends in a fork, at which the curves are far enough apart for a
larger angle.
"""

from dataclasses import replace
from itertools import combinations

import numpy as np

from polycube.surface.arc_length import lengths
from polycube.surface.curves.features import Crease, Features, covered

OFF = 0.002  # of the diagonal: largest distance of the common path from both curves
LEAST = 0.02  # length of a common path, in diagonals; a fork closer to its corner gains little
MOST = 0.35  # largest share of a curve that a common path replaces
STEP = 0.0005  # spacing of the points that are compared
BLEND = 4 / 3  # lengths of the common path after which a curve is followed exactly again

Way = tuple[int, int]  # number of a curve, and the end at which it leaves a corner


def without_cusps(features: Features) -> Features:
    """Curves for mesh edges to follow: two curves that leave a corner together start as one.

    Returns features with one additional corner (the fork) and one additional curve (which leads to
    it) for each cusp; all others keep their numbers.

    features : features of a CAD model; those of a triangle surface are returned unchanged
    """
    if not features.n_faces:
        return features
    pairs = _pairs(features)
    if not pairs:
        return features
    creases, corners = list(features.creases), list(features.corners)
    for corner, one, two, length in pairs:
        common, fork = _common(features, corner, one, two, length), len(corners)
        corners.append(common.points[-1])
        creases.append(replace(common, ends=(corner, fork)))
        for number, end in (one, two):
            own = _turned(creases[number]) if end else creases[number]
            own = _from_fork(own, length, corners[fork], fork)
            creases[number] = _turned(own) if end else own
    is_fixed = np.append(features.is_fixed, np.ones(len(pairs), bool))
    return replace(features, creases=tuple(creases), corners=np.array(corners), is_fixed=is_fixed)


def _pairs(features: Features) -> list[tuple[int, Way, Way, float]]:
    """Corners, two curves that leave each in one direction, and the common length; longest first.

    Each end of a curve is in at most one pair.
    """
    leaving, is_double = dict[int, list[Way]](), covered(features)
    for number, crease in enumerate(features.creases):
        for end in (0, 1) if not crease.is_loop and not is_double[number] else ():
            leaving.setdefault(crease.ends[end], []).append((number, end))
    found = []
    for corner, ways in leaving.items():
        for one, two in combinations(ways, 2):
            faces = [set(features.creases[number].faces) for number, _ in (one, two)]
            if [len(faces[0] & faces[1]), len(faces[0] ^ faces[1])] == [1, 2]:
                length = _together(features, one, two)
                if length >= LEAST:
                    found.append((corner, one, two, length))
    used: set[Way] = set()
    pairs = []
    for pair in sorted(found, key=lambda each: -each[3]):
        if not used & {pair[1], pair[2]}:
            used |= {pair[1], pair[2]}
            pairs.append(pair)
    return pairs


def _at(features: Features, way: Way, arc: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) and inside angles (N,) of a curve at distances (N,) from one of its ends."""
    crease = features.creases[way[0]]
    places, _, inside = crease.at(crease.length - arc if way[1] else arc)
    return places, inside


def _together(features: Features, one: Way, two: Way) -> float:
    """Length from the common corner within which two curves are closer than twice `OFF`."""
    least = min(features.creases[number].length for number, _ in (one, two))
    arc = np.arange(0, MOST * least, STEP)
    gap = np.linalg.norm(_at(features, one, arc)[0] - _at(features, two, arc)[0], axis=1)
    apart = gap > 2 * OFF
    return float(arc[apart.argmax() - 1] if apart.any() else arc[-1])


def _common(features: Features, corner: int, one: Way, two: Way, length: float) -> Crease:
    """The mean of two curves that leave a corner together, between the faces on the outer sides."""
    arc = np.linspace(0, length, 2 + int(length / STEP))
    (first, a), (second, b) = (_at(features, way, arc) for way in (one, two))
    faces = [set(features.creases[number].faces) for number, _ in (one, two)]
    low, high = sorted(faces[0] ^ faces[1])
    inside = np.clip((a + b)[1:] - np.pi, 0, 2 * np.pi)  # between the faces on the outer sides
    points, off = (first + second) / 2, float(np.linalg.norm(first - second, axis=1).max() / 2)
    return Crease(points, lengths(points), inside, (corner, -1), (low, high), off)


def _from_fork(crease: Crease, length: float, fork: np.ndarray, name: int) -> Crease:
    """A curve that starts at the fork and blends into the original curve."""
    blend = BLEND * length
    first = int(np.searchsorted(crease.arc, blend, side="right"))
    points = np.vstack([fork, crease.at(np.array([blend]))[0], crease.points[first:]])
    inside = np.append(crease.inside[first - 1], crease.inside[first - 1 :])
    return Crease(points, lengths(points), inside, (name, crease.ends[1]), crease.faces)


def _turned(crease: Crease) -> Crease:
    """The same curve in the opposite direction."""
    points, ends = crease.points[::-1], (crease.ends[1], crease.ends[0])
    return Crease(points, lengths(points), crease.inside[::-1], ends, crease.faces)
