"""Planar graph of lines: coincident lines are merged, and crossings become points; vectors."""

from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from polycube.hexmesh.background.background import NoBackgroundError
from polycube.surface import closest
from polycube.surface.arc_length import lengths
from polycube.surface.curves.creases import chains_of, vertices_of
from polycube.surface.measures import coincident, connected, unit

SMOOTH = np.radians(30)  # largest turn of a polyline that approximates a curve
STRAIGHT = 1e-3  # smallest such turn
LAST = np.radians(16)  # the same at the only smooth end of a line
SAG = 1.5  # relative to the distance of a chord from its arc: for two polylines of one curve
SPACING = 4.0  # least distance of points along smooth lines, relative to that of details
ROUNDS = 4  # rounds of merging
MOST = 60000  # largest number of lines


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(N,) cross product of vectors (N, 2), positive if b is left of a."""
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def sagitta(path: np.ndarray) -> float:
    """Largest distance of points (N, 2) in order from the line through the first and the last."""
    return float(abs(cross(path - path[0], unit(path[-1:] - path[:1]))).max())


def to_lines(points: np.ndarray, lines: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances (P, S) of points (P, 2) from lines (S, 2, 2), and the shares (P, S) along them."""
    start, step = lines[:, 0], lines[:, 1] - lines[:, 0]
    out = points[:, None] - start
    share = (out * step).sum(axis=2) / np.maximum((step**2).sum(axis=1), 1e-300)
    share = np.clip(share, 0, 1)
    return np.linalg.norm(out - share[..., None] * step, axis=2), share


def arrangement(
    points: np.ndarray, lines: np.ndarray, near: float
) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 2) and edges (E, 2), with ascending ends, of the planar graph of lines.

    Lines with a loose end are left out.

    Raises NoBackgroundError if there are too many lines.

    points : (P, 2)
    lines : (S, 2) indices of points
    near : distance below which points are merged
    """
    name, sag = coincident(points, near)[1], _sags(points, lines)
    points = _means(points, name)
    lines, sag = _distinct(name[lines], sag)
    if len(lines) > MOST:
        raise NoBackgroundError(f"its section has {len(lines)} lines, more than {MOST}")
    sag = np.maximum(sag, _sags(points, lines))
    for done in range(ROUNDS):
        number = len(lines)
        owner, point = _points_on(points, lines, sag, near, done > 0)
        lines, sag = _split(points, lines, sag, owner, point)
        points, lines, sag = _without_short(points, lines, sag, near)
        if done and len(lines) == number and not len(owner):
            break
    crossing, owner = _crossings(points, lines, near)
    point = len(points) + np.repeat(np.arange(len(crossing)), 2)
    points = np.concatenate([points, crossing])
    lines, sag = _split(points, lines, sag, owner.ravel(), point)
    name = coincident(points, near)[1]
    lines, _ = _distinct(name[lines], sag)
    while (loose := (np.bincount(lines.ravel())[lines] == 1).any(axis=1)).any():
        lines = lines[~loose]
    used, row = np.unique(lines, return_inverse=True)
    return _means(points, name)[used], row.reshape(-1, 2)


def simplified(
    points: np.ndarray, lines: np.ndarray, near: float, narrow: float
) -> tuple[np.ndarray, np.ndarray]:
    """Points (P', 2) and lines (S', 2) of polylines that are so simple that details can be merged.

    A polyline that is as a whole close to longer ones is left out; its points are moved onto these.
    Smooth ones have fewer points, whose distances are larger than the details.

    near, narrow : size of the details, and largest width of a strip that is closed
    """
    places, kept = np.pad(points, ((0, 0), (0, 1))), np.zeros((0, 2), np.int64)
    chains = [vertices_of(lines, chain) for chain in chains_of(lines)]
    for own in sorted(chains, key=lambda each: -lengths(places[each])[-1]):
        low, high = places[own].min(axis=0) - narrow, places[own].max(axis=0) + narrow
        ends = places[kept]
        ends = ends[((ends.max(axis=1) > low) & (ends.min(axis=1) < high)).all(axis=1)]
        if len(ends):
            at = closest.closest(closest.tree(ends[:, [0, 1, 1]]), places[own])[0]
            if np.linalg.norm(at - places[own], axis=1).max() < narrow:
                places[own] = at
                continue
        steps = unit(np.diff(places[own], axis=0))
        turn = np.arccos(np.clip((steps[1:] * steps[:-1]).sum(axis=1), -1, 1))
        for first, last in pairwise([0, *(np.flatnonzero(turn > LAST) + 1), len(own) - 1]):
            arc = lengths(places[own[first : last + 1]])
            number = max(1, turn[first : last - 1].sum() / SMOOTH, arc[-1] / (SPACING * near))
            wanted = np.linspace(0, arc[-1], min(int(number), last - first) + 1)
            some = own[first + np.unique(abs(arc - wanted[:, None]).argmin(axis=1))]
            kept = np.concatenate([kept, np.stack([some[:-1], some[1:]], axis=1)])
    used, row = np.unique(kept, return_inverse=True)
    return places[used, :2], row.reshape(-1, 2)


def _means(points: np.ndarray, name: np.ndarray) -> np.ndarray:
    number = np.bincount(name)
    return np.stack([np.bincount(name, c) / number for c in points.T], axis=1)


def _distinct(lines: np.ndarray, sag: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lines without duplicates, and the smallest sag (S,) of the chords among those of each."""
    differs = lines[:, 0] != lines[:, 1]
    found, row = np.unique(np.sort(lines[differs], axis=1), axis=0, return_inverse=True)
    least = np.full(len(found), np.inf)
    np.minimum.at(least, row.ravel(), np.where(sag > 0, sag, np.inf)[differs])
    return found, np.where(np.isinf(least), 0, least)


def _sags(points: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """(S,) largest distance of each line from the curve of which it is a chord; 0 if straight.

    A polyline of a curve has a small turn at an end of a chord, and similar chords.
    """
    step = points[lines[:, 1]] - points[lines[:, 0]]
    length = np.linalg.norm(step, axis=1)
    inner, one, two = passed(lines, len(points))
    away = np.where(np.array([one, two]) % 2, -1, 1)[..., None] * step[[one // 2, two // 2]]
    turn = np.full(len(points), np.inf)
    both = np.maximum(length[one // 2] * length[two // 2], 1e-300)  # equal points may be connected
    turn[inner] = np.arccos(np.clip(-np.einsum("nd,nd->n", *away) / both, -1, 1))
    chord = np.zeros(len(points))
    chord[inner] = np.minimum(length[one // 2], length[two // 2])
    low, high = np.sort(turn[lines], axis=1).T
    # where a curve ends, its turn is half as large or has no limit
    is_chord = (high < SMOOTH) | (low < LAST)
    angle = np.where(high < SMOOTH, np.minimum(2 * low, high), low.clip(0, LAST))
    length = np.where(turn < SMOOTH, chord, np.inf)[lines].min(axis=1)
    is_chord &= angle > STRAIGHT
    return np.where(is_chord, SAG * length * np.tan(angle / 4) / 2, 0.0)


def passed(lines: np.ndarray, number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (N,) of some `number` with two lines, and the ends 2 line + end (N,) of both there."""
    degree = np.bincount(lines.ravel(), minlength=number)
    end = np.argsort(lines.ravel(), kind="stable")
    first = np.cumsum(degree) - degree
    inner = np.flatnonzero(degree == 2)
    return inner, end[first[inner]], end[first[inner] + 1]


def _points_on(
    points: np.ndarray, lines: np.ndarray, sag: np.ndarray, near: float, may_cross: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Lines (N,) and points (N,) on them between their ends, or on the curves of chords.

    Points closer than `near` to an end are not between.

    sag : (S,) of the lines; a point of other chords may be on one of these

    may_cross : else, not a point at which other lines cross a chord; they cross its curve
        elsewhere, and another polyline of the curve may show where
    """
    start, step = points[lines[:, 0]], np.diff(points[lines], axis=1)[:, 0]
    length = np.linalg.norm(step, axis=1)
    balls = cKDTree(points).query_ball_point(start + step / 2, length / 2 + near + 2 * sag)
    owner = np.repeat(np.arange(len(lines)), [len(each) for each in balls])
    point = np.concatenate([*balls, []]).astype(np.int64)
    out = points[point] - start[owner]
    along = np.einsum("nd,nd->n", out, step[owner]) / length[owner]
    off = abs(out[:, 0] * step[owner, 1] - out[:, 1] * step[owner, 0]) / length[owner]
    least = np.full(len(points), np.inf)
    np.minimum.at(least, lines.ravel(), np.repeat(sag, 2))
    gap = np.maximum(near, sag[owner] + np.minimum(least[point], sag[owner]))
    on = (off < gap) & (along > near) & (along < length[owner] - near)
    on &= (point[:, None] != lines[owner]).all(axis=1)
    if not may_cross:
        beside = np.tile(np.arange(len(points)), (2, 1))
        inner, *two = passed(lines, len(points))
        beside[:, inner] = lines.ravel()[np.array(two) ^ 1]  # the other ends of their lines
        side = [cross(points[each[point]] - start[owner], step[owner]) for each in beside]
        far = gap * length[owner]
        on &= (np.minimum(*side) >= -far) | (np.maximum(*side) <= far) | (gap <= 2 * near)
    return owner[on], point[on]


def _split(
    points: np.ndarray, lines: np.ndarray, sag: np.ndarray, owner: np.ndarray, point: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Divide lines at points (N,) on the lines `owner` (N,), without duplicates; their sags."""
    ends = lines.ravel()
    owner = np.concatenate([np.repeat(np.arange(len(lines)), 2), owner])
    point = np.concatenate([ends, point])
    start = points[lines[owner, 0]]
    along = np.einsum("nd,nd->n", points[point] - start, points[lines[owner, 1]] - start)
    order = np.lexsort([along, owner])
    owner, point = owner[order], point[order]
    same = owner[1:] == owner[:-1]
    return _distinct(np.stack([point[:-1], point[1:]], axis=1)[same], sag[owner[1:][same]])


def _without_short(
    points: np.ndarray, lines: np.ndarray, sag: np.ndarray, near: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Merge the ends of chords that are shorter than their distance from the curve."""
    is_short = np.linalg.norm(np.diff(points[lines], axis=1)[:, 0], axis=1) < np.maximum(near, sag)
    first, second = lines[is_short].T
    name = connected(first, second, len(points))
    return _means(points, name), *_distinct(name[lines], sag)


def _crossings(points: np.ndarray, lines: np.ndarray, near: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 2) where two lines cross between their ends, and these lines (N, 2)."""
    start, step = points[lines[:, 0]], np.diff(points[lines], axis=1)[:, 0]
    low, high = points[lines].min(axis=1), points[lines].max(axis=1)
    order = np.argsort(low[:, 0], kind="stable")
    # from left to right, a line can cross those that begin before it ends
    last = np.searchsorted(low[order, 0], high[order, 0], side="right")
    number = last - np.arange(len(order)) - 1
    one = np.repeat(np.arange(len(order)), number)
    two = one + 1 + np.arange(len(one)) - np.repeat(np.cumsum(number) - number, number)
    one, two = order[one], order[two]
    meet = (low[one, 1] <= high[two, 1]) & (low[two, 1] <= high[one, 1])
    one, two = one[meet], two[meet]
    det = cross(step[one], step[two])
    out = start[two] - start[one]
    with np.errstate(divide="ignore", invalid="ignore"):
        s, t = cross(out, step[two]) / det, cross(out, step[one]) / det
    length = np.linalg.norm(step, axis=1)
    both = np.minimum(s, 1 - s) * length[one] > near
    both &= np.minimum(t, 1 - t) * length[two] > near
    found = start[one[both]] + s[both, None] * step[one[both]]
    return found, np.stack([one[both], two[both]], axis=1)
