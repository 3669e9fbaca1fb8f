"""The path of a bent bar or tube: lines, arcs and helices, traced from one of its ends."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from polycube.hexmesh.background.arrangement import to_lines
from polycube.hexmesh.background.background import Background, NoBackgroundError
from polycube.hexmesh.background.motion import PARALLEL, Motion, screw, turn
from polycube.surface import measures
from polycube.types import TriMesh

from ..stack import NEAR
from ..walls import SAG

PLANE = 1e-6  # share of the area that an end may lose in its mean direction
PAST = 1e-4  # of a motion: distance of its wall beyond its ends
HELICAL = 3e-4  # of the diagonal: tolerance for helical faces, which CAD programs approximate
FLAT = 1e-4  # of the extent of an end: distance of its vertices from its plane, and shortest motion
ENDS = 60  # largest number of planes that are tried as an end


class Path(NamedTuple):
    """A section, and the motions that carry it along a part."""

    background: Background  # with the length of the path as its third coordinate
    motions: list[Motion]  # between any two levels
    # (K,) largest distance of the section from the axis of each rotation; 0 of others
    radius: np.ndarray


def path(surface: TriMesh) -> Path:
    """The path from one plane end of a part to the other.

    All other faces must lead from one plane to the next by a translation or a rotation.

    Raises NoBackgroundError if there is no such path, or if it has no arc.
    """
    if not len(surface.region):
        raise NoBackgroundError("it has no CAD faces")
    sums, _ = measures.cad_vectors(surface)
    size = np.linalg.norm(sums, axis=1)
    planes = np.flatnonzero(~measures.curved_faces(surface, PLANE) & (size > 0))
    one, two = measures.between_faces(surface)
    faces = surface.region[np.stack([one // 3, two // 3], axis=1)]
    curves = measures.half_edges(surface.faces)[one], faces
    reason = NoBackgroundError("it has no plane end")
    for end in planes[np.argsort(size[planes], kind="stable")][:ENDS].tolist():
        try:
            return _traced(surface, curves, end, -sums[end] / size[end])
        except NoBackgroundError as found:
            reason = found
    raise reason


def _traced(
    surface: TriMesh, curves: tuple[np.ndarray, np.ndarray], end: int, normal: np.ndarray
) -> Path:
    """The path from an end with an inner normal.

    curves : ends (E, 2) of the edges between faces, and the two faces (E, 2)
    """
    x, size = surface.vertices, measures.diagonal(surface)
    ends, faces = curves
    rows, seen = measures.frame(normal), {end}
    motions: list[Motion] = []
    here = np.flatnonzero((faces == end).any(axis=1))
    origin = x[ends[here]].mean(axis=(0, 1))
    lines, marks = ((x - origin) @ rows[:2].T)[ends[here]], [np.zeros((0, 2))]
    while True:
        beyond = faces[here][~np.isin(faces[here], list(seen))]
        group = set(beyond.tolist())
        if len(beyond) < len(here):
            raise NoBackgroundError("its section is not constant along a path")
        own = np.isin(faces, list(group))
        after = np.setdiff1d(np.flatnonzero(own.any(axis=1) & ~own.all(axis=1)), here)
        seen |= group
        if not len(after):
            break
        chord = np.linalg.norm(np.diff(lines, axis=1)[:, 0], axis=1).max()
        wall = np.isin(surface.region, list(group))
        used = np.unique(surface.faces[wall])
        for motion in between(surface, ends[here], normal, ends[after], wall):
            share = motion.share(x[used])
            flat = motion.move(x[used], -share)
            for before in reversed(motions):
                flat = before.move(flat, -np.ones(len(flat)))
            flat = (flat - origin) @ rows[:2].T
            off = to_lines(flat, lines)[0].min(axis=1)
            far = SAG * chord + (HELICAL if motion.angle and motion.advance else NEAR) * size
            if off.max() <= far and min(share.min(), 1 - share.max()) >= -PAST:
                break
        else:
            where = measures.place(surface, x[used[off.argmax()]])
            raise NoBackgroundError(f"its section is not constant along a path near {where}")
        marks.append(flat[np.isin(used, ends[own.all(axis=1)].ravel())])
        normal = motion.move(x[:1] + normal, np.ones(1))[0] - motion.move(x[:1], np.ones(1))[0]
        motions.append(motion)
        here = after
    if seen != set(faces.ravel().tolist()) or len(group) != 1:
        raise NoBackgroundError("its path ends before all faces are passed")
    if not any(motion.angle for motion in motions):
        raise NoBackgroundError("it has no bend")
    return _path(lines, np.concatenate(marks), motions, origin, rows)


def between(
    surface: TriMesh, here: np.ndarray, normal: np.ndarray, after: np.ndarray, wall: np.ndarray
) -> Iterator[Motion]:
    """The motions that may carry a curve in a plane to another one; edges (N, 2) and (M, 2).

    normal : (3,) of the first plane.  wall : (F,) whether a triangle is between the curves

    Raises NoBackgroundError if the other curve is not plane, or is about the same centre.
    """
    x = surface.vertices
    centre, target = x[here].mean(axis=(0, 1)), x[after].mean(axis=(0, 1))
    out = x[np.unique(after)] - target
    _, _, axes = np.linalg.svd(out, full_matrices=False)
    other, step = axes[2], target - centre
    length = np.linalg.norm(step)
    extent = abs(out).max()
    if abs(out @ other).max() > FLAT * extent or length < FLAT * extent:
        raise NoBackgroundError("its section is not constant along a path")
    axis, ends = np.cross(normal, other), (centre, target, normal)
    if np.linalg.norm(axis) > PARALLEL:
        axis /= np.linalg.norm(axis)
        planes = np.stack([normal, other, axis])
        foot = np.linalg.solve(planes, [centre @ normal, target @ other, centre @ axis])
        yield turn(*ends, axis, foot)
    elif normal @ step < 1e-3 * length:  # a half turn
        yield turn(*ends, np.cross(normal, step) / length, (centre + target) / 2)
    else:
        forward = float(step @ normal)
        yield Motion(normal, centre, step / length, 0.0, forward, forward, normal)
    found = screw(surface, wall)
    if found is not None and np.linalg.norm(np.cross(centre - found[1], found[0])) > 0.1 * extent:
        yield turn(*ends, *found)  # not a bar that is twisted about its own axis


def _path(
    lines: np.ndarray,
    marks: np.ndarray,
    motions: list[Motion],
    origin: np.ndarray,
    rows: np.ndarray,
) -> Path:
    levels = np.append(0, np.cumsum([motion.length for motion in motions]))

    def place(at: np.ndarray) -> np.ndarray:
        points = origin + at[:, :2] @ rows[:2]
        for low, motion in zip(levels, motions, strict=False):
            points = motion.move(points, np.clip((at[:, 2] - low) / motion.length, 0, 1))
        return points

    flat = lines.reshape(-1, 2)
    background = Background(flat, np.arange(len(flat)).reshape(-1, 2), marks, levels, place)
    radius = []
    for low, motion in zip(levels, motions, strict=False):
        out = place(np.column_stack([flat, np.full(len(flat), low)])) - motion.centre
        radius.append(float((out @ motion.ahead).max()) if motion.angle else 0.0)
    return Path(background, motions, np.array(radius))
