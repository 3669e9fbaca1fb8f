"""The sloping backs of ribs, from one wall or cap to another."""

import numpy as np

from polycube.hexmesh.background.curves import Sizes
from polycube.surface.measures import half_edges, triangle_vectors
from polycube.types import TriMesh

from .leaning import Leaning, is_loop, leaning
from .squared import SquaredOff, squared_off

SLOPE = 0.25  # smallest slope of the back of a rib; others are set flat
UNEVEN = 0.15  # largest rise of an end on a round wall, relative to that of the back


def squared_rib(
    at: np.ndarray, before: np.ndarray, face: Leaning, sizes: Sizes
) -> SquaredOff | None:
    """Make the back of a rib square, in place; None, without changes, if the face is none.

    at, before : (V, 3) vertices in the frame, now and before any face was set
    sizes : wanted length of edges, and their largest distance from the back
    """
    if not is_back(before, face, sizes.size):
        return None
    ends = [before[border.vertices].mean(axis=0) for border in face.borders]
    rows = max(2, round(float(np.linalg.norm(ends[1] - ends[0])) / sizes.size))
    is_below = triangle_vectors(before[face.faces])[:, 2].sum() < 0
    return squared_off(at, before, face, int(is_below), sizes, False, np.zeros(0, int), rows)


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
    number: int,
    surface: TriMesh,
    at: np.ndarray,
    beyond: np.ndarray,
    is_wall: np.ndarray,
    is_cap: np.ndarray,
    near: float,
    size: float,
) -> bool:
    """Move uneven borders of a face to constant heights, in place; whether it leans between them.

    These are the ends of the back of a rib, which come to the height of a cap that they touch, and
    borders at a cap that are cut by a wall, as by a hole near a rounded edge.

    beyond : (3 F,) the face on the other side of each edge
    is_wall, is_cap : (R,) whether each face is along the axis, and perpendicular to it
    """
    own = surface.region == number
    other, ends = beyond[np.repeat(own, 3)], half_edges(surface.faces[own])
    before, is_cut = at[:, 2].copy(), False
    low, high = before[ends].min(), before[ends].max()
    beside = np.setdiff1d(other, [number])
    curves = [ends[other == one] for one in beside]
    flat = [curve for curve in curves if np.ptp(before[curve]) < UNEVEN * (high - low)]
    for is_upper in (False, True):
        used = [c.ravel() for c in flat if (before[c].mean() > (low + high) / 2) == is_upper]
        if used:
            end = np.concatenate(used)
            at_cap = np.isin(end, surface.faces[is_cap[surface.region]])
            at[end, 2] = before[end[at_cap] if at_cap.any() else end].mean()
    for one, curve in zip(beside, curves, strict=True):
        vertices, count = np.unique(curve, return_counts=True)
        tips = vertices[count == 1]
        is_uneven = len(tips) > 0 and np.ptp(before[tips]) < 10 * near < np.ptp(before[curve])
        off = abs(before[tips[:1], None] - [low, high]).min(initial=np.inf)
        if is_wall[one] and is_uneven and off < 10 * near:
            at[curve, 2], is_cut = before[tips].mean(), True
    face = leaning(surface, at, beyond, number, near)
    is_found = face is not None and (is_cut or is_back(at, face, size))
    if not is_found:
        at[:, 2] = before
    return is_found
