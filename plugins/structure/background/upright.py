"""Chamfers, fillets, drafts and countersinks set upright or flat, so that a part is a stack.

A face that leans has two borders at constant heights. If only one of them is at a wall, the face
becomes a wall over it. If both are, or if the face is shallow, it becomes a plane at the height of
one of them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple, NoReturn

import numpy as np

from polycube.hexmesh.background.background import NoBackgroundError
from polycube.hexmesh.background.plane import cross, frame
from polycube.numerics.harmonic import harmonic
from polycube.surface.curves.creases import chains_of, vertices_of
from polycube.surface.measures import (
    edges,
    face_areas,
    face_normals,
    half_edges,
    place,
    twins,
)
from polycube.types import TriMesh

CAP = 1 - 5e-4  # smallest mean cosine between the normals of a cap and the axis
WALL = 0.03  # largest mean cosine of a wall
LEVEL = 1e-2  # largest slope of a curve at constant height
SHALLOW = 0.25  # smallest slope of a face that becomes a wall
WIDE = 0.5  # largest width of a face that becomes a wall round a hole, relative to its radius


class Border(NamedTuple):
    """A curve at constant height along a face.

    Parameters
    ----------
    vertices : (N,) in order; the last is the first if it is a loop
    beyond : (N - 1,) the face on the other side of each edge
    """

    vertices: np.ndarray
    beyond: np.ndarray


class Leaning(NamedTuple):
    """A face that is neither a cap nor a wall.

    Parameters
    ----------
    faces : (N, 3) its triangles
    borders : one or two curves at constant height, the lower one first
    sides : (N,) vertices of each curve from one border to the other
    """

    faces: np.ndarray
    borders: tuple[Border, ...]
    sides: tuple[np.ndarray, ...]


class Upright(NamedTuple):
    """A surface whose leaning faces are set upright along an axis, or flat across it.

    Parameters
    ----------
    surface : with the changed vertices
    is_cap : (F,) whether a triangle is in a plane across the axis
    is_changed : (F,) whether it is in a face that leaned
    """

    surface: TriMesh
    is_cap: np.ndarray
    is_changed: np.ndarray


def upright(surface: TriMesh, axis: np.ndarray, near: float) -> Upright:
    """Set the leaning faces of a surface upright, or flat.

    Parameters
    ----------
    near : distance below which heights are equal

    Raises
    ------
    NoBackgroundError
        If a face that leans does not have one or two borders at constant heights, or if a plane
        is oblique.
    """
    rows = frame(axis)
    at = surface.vertices @ rows.T
    before = at.copy()
    area = face_areas(surface)
    total = np.maximum(np.bincount(surface.region, area), 1e-300)
    lean = np.bincount(surface.region, area * abs(face_normals(surface) @ axis)) / total
    is_wall, is_cap = lean < WALL, lean > CAP
    is_changed = ~(is_wall | is_cap)[surface.region]
    leans = np.unique(surface.region[is_changed]).tolist()
    waiting = {number: _leaning(surface, at, number, near) for number in leans}
    while waiting:
        # those at walls first, and the largest of them
        number = max(
            waiting,
            key=lambda n: (any(is_wall[b.beyond].all() for b in waiting[n].borders), total[n]),
        )
        is_wall[number] = _set(at, before, waiting.pop(number), is_wall, is_cap)
        is_cap[number] = not is_wall[number]
    on_cap = is_cap[surface.region]
    is_oblique = on_cap & (np.ptp(at[surface.faces, 2], axis=1) > 10 * near)
    if is_oblique.any():
        where = place(surface, surface.vertices[surface.faces[np.argmax(is_oblique), 0]])
        raise NoBackgroundError(f"a plane is not perpendicular to an axis near {where}")
    return Upright(replace(surface, vertices=at @ rows), on_cap, is_changed)


def _leaning(surface: TriMesh, at: np.ndarray, number: int, near: float) -> Leaning:
    """The borders of a face, in a frame whose last axis is upright."""
    own = surface.region == number
    ends = half_edges(surface.faces)
    one, two = twins(surface.faces)
    other = np.empty(len(ends), np.int64)
    other[one], other[two] = surface.region[two // 3], surface.region[one // 3]
    is_border = np.repeat(own, 3) & (other != number)
    ends, other = ends[is_border], other[is_border]
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
        _refuse(surface, own)
    if len(borders) not in (1, 2) or (len(borders) == 1 and sides):
        _refuse(surface, own)
    borders.sort(key=lambda border: at[border.vertices, 2].mean())
    return Leaning(surface.faces[own], tuple(borders), sides)


def _refuse(surface: TriMesh, own: np.ndarray) -> NoReturn:
    where = place(surface, surface.vertices[surface.faces[own]].mean(axis=(0, 1)))
    raise NoBackgroundError(
        f"a face leans, and has no two borders at constant heights, near {where}"
    )


def _set(
    at: np.ndarray, before: np.ndarray, face: Leaning, is_wall: np.ndarray, is_cap: np.ndarray
) -> bool:
    """Set a face upright or flat in place; whether it becomes a wall.

    before : (V, 3) vertices before any face was set
    """
    used, borders = np.unique(face.faces), face.borders
    heights = [at[border.vertices, 2].mean() for border in borders]
    lengths = [_arc(before[border.vertices, :2])[-1] for border in borders]
    at_wall = [bool(is_wall[border.beyond].all()) for border in borders]
    if len(borders) == 1 or all(at_wall):
        at[used, 2] = heights[int(np.argmax(lengths))]
        return False
    base = at_wall.index(True) if any(at_wall) else 0
    top, foot = borders[1 - base], _over(at, before, face, base)
    run = np.linalg.norm(foot - at[:, :2], axis=1)[top.vertices].mean()
    most = (heights[1] - heights[0]) / SHALLOW
    if is_loop(top.vertices):
        most = min(most, WIDE * lengths[base] / (2 * np.pi))
    if run > most and at_wall[base] and is_cap[top.beyond].all():
        at[used, 2] = heights[1 - base]
        return False
    at[used, :2] = foot[used]
    return True


def _over(at: np.ndarray, before: np.ndarray, face: Leaning, base: int) -> np.ndarray:
    """(V, 2) places of the vertices of a face over one of its borders.

    Shares of the lengths of both borders are equal, and harmonic between them.
    """
    foot, top = face.borders[base].vertices, face.borders[1 - base].vertices
    is_round = is_loop(foot)
    if _is_reversed(before, face, foot, top):
        top = top[::-1]
    arcs = [_arc(before[border, :2]) for border in (foot, top)]
    knots, share = (arc / arc[-1] for arc in arcs)
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


def is_loop(vertices: np.ndarray) -> bool:
    """Whether a line returns to its first vertex."""
    return bool(vertices[0] == vertices[-1])


def _arc(points: np.ndarray) -> np.ndarray:
    """(N,) arc length at each point of a line."""
    return np.append(0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
