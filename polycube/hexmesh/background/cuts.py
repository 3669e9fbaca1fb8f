"""Cuts of a section straight across its cells, from their re-entrant corners."""

import numpy as np

from polycube.hexmesh.background.arrangement import cross
from polycube.hexmesh.background.borders import Side, angles, polylines
from polycube.hexmesh.background.curves import Curve
from polycube.surface.arc_length import lengths

RE_ENTRANT = np.radians(200)  # smallest inner angle of such a corner
SQUARE = 0.5  # largest cosine of the angle between a cut and the curve at its end
SNAP = 0.25  # of the length of a cut: largest distance of its end from a corner that it meets
NOWHERE = np.full(2, np.inf)
SAME = 1e-6  # relative tolerance for equal points
LONGEST = 4.0  # of the wanted edge length: the same for a cut


def cuts(chains: list[Curve], loops: list[list[Side]], size: float) -> np.ndarray:
    """(N, 2, 2) lines from re-entrant corners of cells to the opposite side, one from each.

    It is perpendicular to one of the curves at the corner, the one that is longer relative to the
    cut, so that a ring with a slit, an angle or a tee is divided into cells with four corners.
    """
    found = []
    for cell in loops:
        sides = [polylines(chains, loop) for loop in cell]
        lines = [line for side in sides for line in side]
        start = np.concatenate([line[:-1] for line in lines])
        step = np.concatenate([np.diff(line, axis=0) for line in lines])
        corners = np.array([line[0] for line in lines])
        for loop, own in zip(cell, sides, strict=True):
            for n in np.flatnonzero(angles(chains, loop) > RE_ENTRANT).tolist():
                point = own[n][0]
                beside = own[n][1] - point, point - own[n - 1][-2]
                ends = np.array([_end(point, along, start, step, corners) for along in beside])
                length = np.linalg.norm(ends - point, axis=1)
                length[length > LONGEST * size] = np.inf
                ratio = length / [lengths(own[n])[-1], lengths(own[n - 1])[-1]]
                if np.isfinite(ratio).any():
                    found.append([point, ends[ratio.argmin()]])
    return np.reshape(found, (-1, 2, 2))


def _end(
    point: np.ndarray, along: np.ndarray, start: np.ndarray, step: np.ndarray, corners: np.ndarray
) -> np.ndarray:
    """(2,) where a line from a point to the left of a direction ends; infinite if it is oblique."""
    normal = np.array([[-along[1], along[0]]]) / np.linalg.norm(along)
    out, det = start - point, cross(step, normal)
    det[abs(det) < SAME * np.linalg.norm(step, axis=1)] = np.inf  # parallel: their length is 0
    far, share = cross(step, out) / det, cross(normal, out) / det
    far[(abs(share - 0.5) > 0.5 + SAME) | (far < SAME * np.ptp(start))] = np.inf
    first = far.argmin()
    oblique = abs(normal[0] @ step[first]) > SQUARE * np.linalg.norm(step[first])
    if np.isinf(far[first]):
        return NOWHERE
    end = point + far[first] * normal[0]
    off = np.linalg.norm(corners - end, axis=1)
    if off.min() < SNAP * far[first]:
        return corners[off.argmin()]
    return NOWHERE if oblique else end
