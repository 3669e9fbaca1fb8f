"""Faces that are neither across an axis nor along it: their borders, and the lines over these."""

from typing import NamedTuple

import numpy as np

from polycube.hexmesh.background.arrangement import cross, sagitta
from polycube.hexmesh.background.curves import Sizes, whole
from polycube.numerics.harmonic import harmonic
from polycube.surface.arc_length import lengths
from polycube.surface.curves.creases import chains_of, vertices_of
from polycube.surface.measures import edges, half_edges
from polycube.types import TriMesh

NARROW = 0.5  # smallest width of a face, relative to that of its profile, that counts
QUARTILE = 0.75  # share of the vertices of a face where it is narrower than its profile
BULGE = 1.01  # distance from a border, relative to that of both, of a face that is not between them
PLUMB = 0.1  # largest run of a face between two walls one over the other, relative to its rise
SHALLOW = 0.25  # smallest slope of a face that becomes a wall
WIDE = 0.5  # largest width of a face that becomes a wall round a hole, relative to its radius
LEVEL = 1e-2  # largest slope of a curve at constant height


class Border(NamedTuple):
    """A curve at constant height along a face."""

    vertices: np.ndarray  # (N,) in order; the last is the first if it is a loop
    beyond: np.ndarray  # (N - 1,) the face on the other side of each edge

    def ends(self, is_wall: np.ndarray, is_cap: np.ndarray) -> tuple[bool, bool]:
        """Whether it is at walls only, and whether it is at caps, which walls may cut."""
        wall, cap = is_wall[self.beyond], is_cap[self.beyond]
        return bool(wall.all()), bool((wall | cap).all() and cap.any())


class Leaning(NamedTuple):
    """A face that is neither a cap nor a wall."""

    faces: np.ndarray  # (N, 3) its triangles
    # one or two curves at constant height, the lower one first; a tip is a curve of one vertex
    borders: tuple[Border, ...]
    sides: tuple[np.ndarray, ...]  # (N,) vertices of each curve from one border to the other


def leaning(
    surface: TriMesh, at: np.ndarray, beyond: np.ndarray, number: int, near: float
) -> Leaning | None:
    """The borders of a face, in a frame whose last axis is upright; None for other borders."""
    own = surface.region == number
    other = beyond.reshape(-1, 3)[own].ravel()
    ends, other = half_edges(surface.faces[own])[other != number], other[other != number]
    rise = abs(np.diff(at[ends, 2], axis=1)[:, 0])
    run = np.linalg.norm(np.diff(at[ends, :2], axis=1)[:, 0], axis=1)
    is_level = (rise < 10 * near) & (rise < LEVEL * run)
    borders = [
        Border(vertices_of(ends[is_level], chain), other[is_level][np.array(chain) // 2])
        for chain in chains_of(ends[is_level])
    ]
    sides = tuple(vertices_of(ends[~is_level], chain) for chain in chains_of(ends[~is_level]))
    uneven = any(np.ptp(at[border.vertices, 2]) > 10 * near for border in borders)
    if uneven or len(sides) != sum(not is_loop(border.vertices) for border in borders):
        return None
    if len(borders) == len(sides) == 1:
        if (tip := _tip(surface, at, number, borders[0], sides[0])) is None:
            return None
        place, faces = tip
        borders.append(Border(sides[0][[place]], faces))
        sides = sides[0][: place + 1], sides[0][place:]
    if len(borders) not in (1, 2) or (len(borders) == 1 and sides):
        return None
    borders.sort(key=lambda border: at[border.vertices, 2].mean())
    return Leaning(surface.faces[own], tuple(borders), sides)


def _tip(
    surface: TriMesh, at: np.ndarray, number: int, border: Border, side: np.ndarray
) -> tuple[int, np.ndarray] | None:
    """The place on a side of the vertex farthest from the border, and the faces opposite there.

    It is the corner of three roundings. None if it is an end, or if no other face is there.
    """
    place = int(abs(at[side, 2] - at[border.vertices[0], 2]).argmax())
    if place in (0, len(side) - 1):
        return None
    before, tip, after = (
        surface.region[(surface.faces == v).any(axis=1)] for v in side[place - 1 : place + 2]
    )
    faces = np.setdiff1d(tip, np.concatenate([before, after, [number]]))
    return (place, faces) if len(faces) else None


def is_loop(vertices: np.ndarray) -> bool:
    """Whether a line returns to its first vertex."""
    return len(vertices) > 1 and bool(vertices[0] == vertices[-1])


def over(at: np.ndarray, before: np.ndarray, face: Leaning, base: int) -> np.ndarray:
    """(V, 2) places of the vertices of a face over one of its borders.

    Shares of the lengths of both borders are equal, and harmonic between them.
    """
    foot, top = face.borders[base].vertices, face.borders[1 - base].vertices
    is_round = is_loop(foot)
    if _is_reversed(before, face, foot, top):
        top = top[::-1]
    arcs = [lengths(before[border, :2]) for border in (foot, top)]
    knots, share = (arc / max(arc[-1], 1e-300) for arc in arcs)
    turn = np.zeros(len(at), complex)
    given = [foot, top, *face.sides]
    if is_round:
        round_ = np.exp(2j * np.pi * knots), np.exp(2j * np.pi * share)
        centred = [before[b, :2] - before[b[:-1], :2].mean(axis=0) for b in (foot, top)]
        closest = np.linalg.norm(centred[1][:, None] - centred[0], axis=2).argmin(axis=1)
        offset = (round_[0][closest] / round_[1])[:-1].mean()
        turn[foot], turn[top] = round_[0], round_[1] * offset / abs(offset)
    else:
        for side in face.sides:
            turn[side] = float(foot[-1] in side)
        turn[foot], turn[top] = knots, share
    used, faces = np.unique(face.faces, return_inverse=True)
    known = np.isin(used, np.concatenate(given))
    values = turn[used].view(float).reshape(-1, 2)
    values = harmonic(before[used], edges(faces.reshape(-1, 3))[0], np.flatnonzero(~known), values)
    where = values[:, 0]
    if is_round:
        where = np.arctan2(values[:, 1], values[:, 0]) / (2 * np.pi) % 1
    over = at[:, :2].copy()
    over[used] = np.stack([np.interp(where, knots, at[foot, d]) for d in (0, 1)], axis=1)
    return over


def _is_reversed(at: np.ndarray, face: Leaning, foot: np.ndarray, top: np.ndarray) -> bool:
    """Whether the order of the vertices of two borders is opposite."""
    if is_loop(foot):
        areas = [cross(at[b[:-1], :2], at[b[1:], :2]).sum() for b in (foot, top)]
        return bool(np.prod(areas) < 0)
    return not any(foot[0] in side and top[0] in side for side in face.sides)


def divided(value: np.ndarray, faces: np.ndarray, limit: float) -> np.ndarray:
    """(F,) whether a value is above a limit in the mean over triangles.

    value : (V,) at vertices; those between the two kinds are set to the limit, in place, and all
        others to the side of their triangles
    """
    is_above = value[faces].mean(axis=1) > limit
    below, above = np.unique(faces[~is_above]), np.unique(faces[is_above])
    value[below], value[above] = np.minimum(value[below], limit), np.maximum(value[above], limit)
    value[np.intersect1d(below, above)] = limit
    return is_above


def between(
    heights: np.ndarray, foot: np.ndarray, top: np.ndarray, at: np.ndarray, sizes: Sizes
) -> tuple[np.ndarray, float]:
    """(N,) heights that divide the profile of a face evenly, so that its chords are close to it.

    Also returns the number of chords, not rounded, whose distance from it is the largest permitted.

    A face that is wider at corners has the profile of its upper quartile; narrow ends do not count.

    heights : (P,) heights of its vertices
    foot, top, at : (P, 2) places over its two borders, and of its vertices
    sizes : largest distance of a chord from the vertices
    """
    width = np.linalg.norm(top - foot, axis=1)
    profile = np.column_stack([heights, np.linalg.norm(at - foot, axis=1)])
    if profile[:, 1].max() < BULGE * width.max():
        wide = np.quantile(width, QUARTILE)
        share = ((at - foot) * (top - foot)).sum(axis=1) / np.maximum(width**2, 1e-300)
        profile[:, 1] = wide * share  # without what places are off along the borders
        profile = profile[width > NARROW * wide]
    profile = profile[profile[:, 0].argsort(kind="stable")]
    least, arc = sizes.chords(sagitta(profile)), lengths(profile)
    number = whole(least)
    return np.interp(np.arange(1, number) / number * arc[-1], arc, profile[:, 0]), least


def set_upright(
    at: np.ndarray,
    before: np.ndarray,
    face: Leaning,
    is_wall: np.ndarray,
    is_cap: np.ndarray,
    is_straight: bool,
) -> bool:
    """Set a face upright or flat in place, and return whether it becomes a wall.

    before : (V, 3) vertices before any face was set
    is_straight : whether vertices move across a straight border, beyond its ends as well
    """
    used, borders = np.unique(face.faces), face.borders
    heights = [at[border.vertices, 2].mean() for border in borders]
    size = [lengths(before[border.vertices, :2])[-1] for border in borders]
    at_wall, at_cap = zip(*(border.ends(is_wall, is_cap) for border in borders), strict=True)
    base = at_wall.index(True) if any(at_wall) else 0
    if not (is_flat := len(borders) == 1):
        top, foot = borders[1 - base], over(at, before, face, base)
        run = np.linalg.norm(foot - at[:, :2], axis=1)[top.vertices].mean()
        is_flat = all(at_wall) and run > PLUMB * (heights[1] - heights[0])
    if is_flat:
        at[used, 2] = heights[int(np.argmax(size))]
        return False
    most = (heights[1] - heights[0]) / SHALLOW
    if is_loop(top.vertices):
        most = min(most, WIDE * size[base] / (2 * np.pi))
    is_cut = not is_cap[top.beyond].all()  # by walls, which cannot move with the border
    if at_cap[1 - base] and (run > most or is_cut) and at_wall[base]:
        at[used, 2] = heights[1 - base]
        return False
    if is_straight:
        along = np.diff(at[borders[base].vertices[[0, -1]], :2], axis=0)
        along /= np.linalg.norm(along)
        foot[used] += ((at[used, :2] - foot[used]) @ along.T) * along
    at[used, :2] = foot[used]
    return True
