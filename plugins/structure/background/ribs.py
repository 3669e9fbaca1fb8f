"""The sloping backs of ribs, from one wall or cap to another."""

import numpy as np

from polycube.surface.measures import half_edges, triangle_vectors
from polycube.types import TriMesh

from .leaning import Leaning, is_loop, leaning
from .squared import SquaredOff, squared_off

SLOPE = 0.25  # smallest slope of the back of a rib; others are set flat
UNEVEN = 0.15  # largest rise of an end on a round wall, relative to that of the back


def squared_rib(
    at: np.ndarray, before: np.ndarray, face: Leaning, size: float, chord: float
) -> SquaredOff | None:
    """Make the back of a rib square, in place; None, without changes, if the face is none.

    at, before : (V, 3) vertices in the frame, now and before any face was set
    size, chord : wanted length of edges, and their largest distance from the back
    """
    if not is_back(before, face, size):
        return None
    ends = [before[border.vertices].mean(axis=0) for border in face.borders]
    rows = max(2, round(float(np.linalg.norm(ends[1] - ends[0])) / size))
    is_below = triangle_vectors(before[face.faces])[:, 2].sum() < 0
    return squared_off(at, before, face, int(is_below), chord, False, rows)


def is_back(at: np.ndarray, face: Leaning, size: float) -> bool:
    """Whether a face is the back of a rib: it is longer than wide, and longer than two hexes."""
    ends = [at[border.vertices] for border in face.borders]
    if len(ends) != 2 or any(len(b.vertices) < 2 or is_loop(b.vertices) for b in face.borders):
        return False
    wide = max(np.linalg.norm(np.diff(end[:, :2], axis=0), axis=1).sum() for end in ends)
    step = ends[1].mean(axis=0) - ends[0].mean(axis=0)
    run = float(np.hypot(*step[:2]))
    return run > max(wide, 2 * size) and step[2] > SLOPE * run


def levelled(
    surface: TriMesh,
    at: np.ndarray,
    number: int,
    beyond: np.ndarray,
    near: float,
    size: float,
    is_cap: np.ndarray,
) -> bool:
    """Move the uneven ends of the back of a rib to constant heights, in place; whether it is one.

    An end that touches a cap comes to its height.

    beyond : (3 F,) the face on the other side of each edge
    is_cap : (F,) whether a triangle is perpendicular to the axis
    """
    own = surface.region == number
    other, ends = beyond.reshape(-1, 3)[own].ravel(), half_edges(surface.faces[own])
    before = at[:, 2].copy()
    low, high = before[ends].min(), before[ends].max()
    curves = [ends[other == one] for one in np.setdiff1d(other, [number])]
    curves = [curve for curve in curves if np.ptp(before[curve]) < UNEVEN * (high - low)]
    for is_upper in (False, True):
        used = [c.ravel() for c in curves if (before[c].mean() > (low + high) / 2) == is_upper]
        if used:
            end = np.concatenate(used)
            at_cap = np.isin(end, surface.faces[is_cap])
            at[end, 2] = before[end[at_cap] if at_cap.any() else end].mean()
    face = leaning(surface, at, beyond, number, near)
    is_rib = face is not None and is_back(at, face, size)
    if not is_rib:
        at[:, 2] = before
    return is_rib
