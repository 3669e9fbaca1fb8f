"""The profile of a turned part: curves (z, r) of its faces in the half-plane of its axis."""

from collections.abc import Iterator

import numpy as np

from polycube.hexmesh.background.arrangement import to_lines
from polycube.hexmesh.background.background import Background, NoBackgroundError
from polycube.surface.curves.creases import chains_of, vertices_of
from polycube.surface.measures import area_vectors, diagonal, face_areas, half_edges, place
from polycube.types import TriMesh

from .axis import Axis
from .stack import NEAR

THICK = 3e-3  # of the diagonal: largest distance of the vertices of a face from its curve
FLAT = 1e-3  # sine: tolerance for planes across the axis, and through it
TRIED = 12  # number of half-planes in which a face is cut
STEPS = 48  # largest number of points along a curved face
SAG = 2e-4  # of the diagonal: largest distance of a simplified curve


def profile(surface: TriMesh, axis: Axis) -> Background:
    """The background grid of a part whose faces are turned about an axis.

    Levels are the angles of plane faces through the axis.

    Raises NoBackgroundError if a face is neither turned about the axis nor in a plane through it.
    """
    at, angle = axis.cylindrical(surface.vertices)
    pieces, levels = [], []
    for number in np.unique(surface.region):
        own = surface.region == number
        normal = area_vectors(surface)[own].sum(axis=0)
        if _is_through_axis(surface, axis, own, normal):
            outward = np.cross(axis.frame[2], normal)
            x, y = axis.frame[:2] @ outward
            side = (surface.vertices[surface.faces[own]].mean(axis=1) - axis.origin) @ outward
            levels += [np.arctan2(sign * y, sign * x) for sign in np.unique(np.sign(side))]
        else:
            pieces.append(_curve(surface, axis, own, at, angle))
    lines = np.concatenate([np.stack([p[:-1], p[1:]], axis=1) for p in pieces])
    marks = np.concatenate([p[[0, -1]] for p in pieces if (p[0] != p[-1]).any()] or [lines[0, :0]])
    start = np.sort(np.mod(levels, 2 * np.pi)) if levels else np.zeros(1)
    start = start[np.append(True, np.diff(start) > FLAT)]
    return Background(
        lines.reshape(-1, 2),
        np.arange(2 * len(lines)).reshape(-1, 2),
        marks,
        np.append(start, start[0] + 2 * np.pi),
        axis.place,
        is_cyclic=True,
    )


def _is_through_axis(surface: TriMesh, axis: Axis, own: np.ndarray, normal: np.ndarray) -> bool:
    """Whether a face is a plane that contains the axis; `normal` is the sum of its area vectors."""
    length = np.linalg.norm(normal)
    if length < (1 - FLAT) * face_areas(surface)[own].sum():  # it is not a plane
        return False
    normal = normal / length
    away = (surface.vertices[np.unique(surface.faces[own])] - axis.origin) @ normal
    near = 10 * NEAR * diagonal(surface)
    return bool(abs(normal @ axis.frame[2]) < FLAT and abs(away).max() < near)


def _curve(
    surface: TriMesh, axis: Axis, own: np.ndarray, at: np.ndarray, angle: np.ndarray
) -> np.ndarray:
    """(N, 2) points (z, r) along a turned face.

    Raises NoBackgroundError if the face is not thin in the half-plane.
    """
    unit, faces = diagonal(surface), surface.faces[own]
    vertices = np.unique(faces)
    is_cap = np.ptp(at[vertices, 0]) < 10 * NEAR * unit
    starts = _between(angle[vertices])
    chains = (_cut(surface.vertices, axis, faces, at, start, is_cap) for start in starts)
    found = max(chains, key=lambda each: np.linalg.norm(np.diff(each, axis=0), axis=1).sum())
    if len(found) < 2:
        where = surface.vertices[vertices].mean(axis=0)
        raise NoBackgroundError(f"a face is not turned near {place(surface, where)}")
    if is_cap:
        return found[[0, -1]]
    gap, share = to_lines(at[vertices], np.stack([found[:-1], found[1:]], axis=1))
    line, row = gap.argmin(axis=1), np.arange(len(vertices))
    off, length = gap[row, line], np.linalg.norm(np.diff(found, axis=0), axis=1)
    if off.max() > THICK * unit:
        where = surface.vertices[vertices[np.argmax(off)]]
        raise NoBackgroundError(f"a face is not turned about the axis near {place(surface, where)}")
    arc = np.append(0, np.cumsum(length))[line] + share[row, line] * length[line]
    order = np.argsort(arc, kind="stable")
    arc, exact = arc[order], at[vertices[order]]
    total = length.sum()
    step, kept, last = total / STEPS, [found[0]], 0.0
    for here, point in zip(arc, exact, strict=True):
        if here - last > step and total - here > step:
            kept.append(point)
            last = here
    return _simplified(np.array([*kept, found[-1]]), SAG * unit)


def _between(angles: np.ndarray) -> Iterator[float]:
    """Angles in the widest gaps between the angles of vertices, at different places."""
    known = np.unique(np.mod(angles, 2 * np.pi))
    gap = np.diff(np.append(known, known[0] + 2 * np.pi))
    inner = np.flatnonzero((gap > 1e-6) & (gap < np.pi))
    for k in inner[np.linspace(0, len(inner) - 1, min(TRIED, len(inner))).astype(int)]:
        yield known[k] + 0.381 * gap[k]


def _cut(
    vertices: np.ndarray, axis: Axis, faces: np.ndarray, at: np.ndarray, start: float, is_cap: bool
) -> np.ndarray:
    """(N, 2) points (z, r) of a face in the half-plane at an angle, along the longest chain.

    Between vertices, (z, r) is interpolated, so that edges along circles have the exact radius;
    in caps, other edges cross the plane nearer to the axis.
    """
    local = (vertices - axis.origin) @ axis.frame.T
    away = -np.sin(start) * local[:, 0] + np.cos(start) * local[:, 1]
    along = np.cos(start) * local[:, 0] + np.sin(start) * local[:, 1]
    ends = half_edges(faces)
    is_cut = (away[ends] > 0).sum(axis=1) == 1
    edge = np.sort(ends[is_cut], axis=1)
    triangle = np.flatnonzero(is_cut) // 3
    share = away[edge[:, 0]] / (away[edge[:, 0]] - away[edge[:, 1]])
    own = along[edge[:, 0]] + share * np.diff(along[edge], axis=1)[:, 0]
    point = at[edge[:, 0]] + share[:, None] * np.diff(at[edge], axis=1)[:, 0]
    _, name, count = np.unique(edge, axis=0, return_inverse=True, return_counts=True)
    name = name.ravel()
    if is_cap:  # the inner edges of a cap are chords
        inner = count[name] == 2
        point[inner, 1] = own[inner]
    a, b = np.argsort(triangle, kind="stable").reshape(-1, 2).T
    inside, outside = np.where(own[a] > 0, a, b), np.where(own[a] > 0, b, a)
    # where a triangle meets the axis, its outer end is moved there
    meets = (own[inside] > 0) & (own[outside] < 0)
    last, first = outside[meets], inside[meets]
    share = own[first] / (own[first] - own[last])
    height = point[first, 0] + share * (point[last, 0] - point[first, 0])
    sides = name[np.stack([inside, outside], axis=1)][own[inside] > 0]
    places = np.zeros((len(name), 2))
    places[name] = point
    places[name[last]] = np.stack([height, np.zeros(len(last))], axis=1)
    chains = [places[vertices_of(sides, chain)] for chain in chains_of(sides)]
    return max(chains, key=len, default=np.zeros((0, 2)))


def _simplified(points: np.ndarray, most: float) -> np.ndarray:
    """The points without those within a distance of the line of others (Douglas and Peucker)."""
    if len(points) < 3:
        return points
    step = points[-1] - points[0]
    length = np.linalg.norm(step)
    out = points - points[0]
    off = np.linalg.norm(out, axis=1)
    if length > most:
        off = abs(out[:, 0] * step[1] - out[:, 1] * step[0]) / length
    far = int(off.argmax())
    if off[far] < most:
        return points[[0, -1]]
    low, high = _simplified(points[: far + 1], most), _simplified(points[far:], most)
    return np.concatenate([low[:-1], high])
