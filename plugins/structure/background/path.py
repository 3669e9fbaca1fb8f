"""The path of a bent bar or tube: lines and arcs, traced over its faces from one of its ends."""

from typing import NamedTuple

import numpy as np

from polycube.hexmesh.background.background import Background, NoBackgroundError
from polycube.hexmesh.background.plane import frame, to_lines
from polycube.surface.measures import (
    between_faces,
    cad_vectors,
    curved_faces,
    diagonal,
    half_edges,
    place,
)
from polycube.types import TriMesh

from .stack import NEAR
from .walls import SAG

PLANE = 1e-6  # share of the area that an end may lose in its mean direction
PARALLEL = 1e-4  # sine: tolerance for parallel planes
ENDS = 60  # largest number of planes that are tried as an end


class Motion(NamedTuple):
    """A translation along an axis, or a rotation about it, from one plane to the next."""

    axis: np.ndarray  # (3,) unit vector
    centre: np.ndarray  # (3,) a point of the first plane; on the axis of a rotation
    ahead: np.ndarray  # (3,) unit vector in the first plane, away from the axis of a rotation
    angle: float  # of a rotation; 0 for a translation
    length: float  # of the path

    def move(self, points: np.ndarray, share: np.ndarray) -> np.ndarray:
        """Points (N, 3) after shares (N,) of the motion."""
        if not self.angle:
            return points + np.multiply.outer(share * self.length, self.axis)
        out = points - self.centre
        along = np.multiply.outer(out @ self.axis, self.axis)
        cosine, sine = (f(share * self.angle)[:, None] for f in (np.cos, np.sin))
        return self.centre + along + cosine * (out - along) + sine * np.cross(self.axis, out)

    def share(self, points: np.ndarray) -> np.ndarray:
        """(N,) shares of the motion from the first plane to points (N, 3)."""
        out = points - self.centre
        if not self.angle:
            return out @ self.axis / self.length
        turn = np.arctan2(out @ np.cross(self.axis, self.ahead), out @ self.ahead)
        return np.where(turn < self.angle / 2 - np.pi, turn + 2 * np.pi, turn) / self.angle


class Path(NamedTuple):
    """A section, and the motions that carry it along a part."""

    background: Background  # with the length of the path as its third coordinate
    motions: list[Motion]  # between any two levels
    # (K,) largest distance of the section from the axis of each rotation; 0 of others
    radius: np.ndarray


def path(surface: TriMesh) -> Path:
    """The path from one plane end of a part to the other.

    All other faces must lead from one plane to the next by a translation or a rotation.

    Raises
    ------
    NoBackgroundError
        If there is no such path, or if it has no arc.
    """
    if not len(surface.region):
        raise NoBackgroundError("it has no CAD faces")
    sums, _ = cad_vectors(surface)
    size = np.linalg.norm(sums, axis=1)
    planes = np.flatnonzero(~curved_faces(surface, PLANE) & (size > 0))
    one, two = between_faces(surface)
    faces = surface.region[np.stack([one // 3, two // 3], axis=1)]
    curves = half_edges(surface.faces)[one], faces
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
    x, near = surface.vertices, NEAR * diagonal(surface)
    ends, faces = curves
    rows, seen = frame(normal), {end}
    motions: list[Motion] = []
    here = np.flatnonzero((faces == end).any(axis=1))
    origin = x[ends[here]].mean(axis=(0, 1))
    first = (x - origin) @ rows[:2].T
    lines, marks = first[ends[here]], [np.zeros((0, 2))]
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
        motion = _motion(x, ends[here], normal, ends[after])
        used = np.unique(surface.faces[np.isin(surface.region, list(group))])
        share = motion.share(x[used])
        flat = motion.move(x[used], -share)
        for before in reversed(motions):
            flat = before.move(flat, -np.ones(len(flat)))
        flat = (flat - origin) @ rows[:2].T
        off = to_lines(flat, lines)[0].min(axis=1)
        chord = np.linalg.norm(np.diff(lines, axis=1)[:, 0], axis=1).max()
        if off.max() > near + SAG * chord or min(share.min(), 1 - share.max()) < -1e-6:
            where = place(surface, x[used[off.argmax()]])
            raise NoBackgroundError(f"its section is not constant along a path near {where}")
        seams = ends[own.all(axis=1)].ravel()
        marks.append(flat[np.isin(used, seams)])
        normal = motion.move(x[:1] + normal, np.ones(1))[0] - motion.move(x[:1], np.ones(1))[0]
        motions.append(motion)
        here = after
    if seen != set(faces.ravel().tolist()) or len(group) != 1:
        raise NoBackgroundError("its path ends before all faces are passed")
    if not any(motion.angle for motion in motions):
        raise NoBackgroundError("it has no bend")
    return _path(lines, np.concatenate(marks), motions, origin, rows)


def _motion(x: np.ndarray, here: np.ndarray, normal: np.ndarray, after: np.ndarray) -> Motion:
    """The motion of a curve in a plane to another one; edges (N, 2) and (M, 2).

    Raises
    ------
    NoBackgroundError
        If the other curve is not plane, or is about the same centre.
    """
    centre, target = x[here].mean(axis=(0, 1)), x[after].mean(axis=(0, 1))
    out = x[np.unique(after)] - target
    _, _, axes = np.linalg.svd(out, full_matrices=False)
    other, step = axes[2], target - centre
    length = np.linalg.norm(step)
    extent = abs(out).max()
    if abs(out @ other).max() > 1e-4 * extent or length < 1e-4 * extent:
        raise NoBackgroundError("its section is not constant along a path")
    if np.linalg.norm(np.cross(normal, other)) > PARALLEL:
        axis = np.cross(normal, other)
        axis /= np.linalg.norm(axis)
        foot = np.linalg.solve(
            np.stack([normal, other, axis]), [centre @ normal, target @ other, centre @ axis]
        )
    elif normal @ step < 1e-3 * length:  # a half turn
        axis, foot = np.cross(normal, step) / length, (centre + target) / 2
    else:
        return Motion(normal, centre, step / length, 0.0, float(step @ normal))
    radius = float(np.linalg.norm(centre - foot))
    ahead = (centre - foot) / radius
    axis = axis * np.sign(np.cross(axis, ahead) @ normal)
    end = target - foot
    angle = float(np.arctan2(end @ np.cross(axis, ahead), end @ ahead) % (2 * np.pi))
    return Motion(axis, foot, ahead, angle, radius * angle)


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
