"""The path of a bent bar or tube: lines, arcs and helices, traced from one of its ends."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from polycube.hexmesh.background.background import Background, NoBackgroundError
from polycube.hexmesh.background.plane import frame, to_lines
from polycube.surface.measures import (
    area_vectors,
    between_faces,
    cad_vectors,
    curved_faces,
    diagonal,
    half_edges,
    place,
    twins,
)
from polycube.types import TriMesh

from .stack import NEAR
from .walls import SAG

PLANE = 1e-6  # share of the area that an end may lose in its mean direction
PARALLEL = 1e-4  # sine: tolerance for parallel planes
PAST = 1e-4  # of a motion: distance of its wall beyond its ends
HELICAL = 3e-4  # of the diagonal: tolerance for helical faces, which CAD programs approximate
NEWTON = 4  # steps to the plane of a point
ENDS = 60  # largest number of planes that are tried as an end


class Motion(NamedTuple):
    """A translation along an axis, a rotation about it, or both, from one plane to the next."""

    axis: np.ndarray  # (3,) unit vector
    centre: np.ndarray  # (3,) a point of the first plane; on the axis of a rotation
    ahead: np.ndarray  # (3,) unit vector in the first plane, away from the axis of a rotation
    angle: float  # of a rotation; 0 for a translation
    length: float  # of the path
    advance: float  # along the axis
    normal: np.ndarray  # (3,) of the first plane

    def move(self, points: np.ndarray, share: np.ndarray) -> np.ndarray:
        """Points (N, 3) after shares (N,) of the motion."""
        out = points - self.centre
        along = np.multiply.outer(out @ self.axis, self.axis)
        cosine, sine = (f(share * self.angle)[:, None] for f in (np.cos, np.sin))
        turned = cosine * (out - along) + sine * np.cross(self.axis, out)
        return self.centre + along + turned + np.multiply.outer(share * self.advance, self.axis)

    def share(self, points: np.ndarray) -> np.ndarray:
        """(N,) shares of the motion from the first plane to points (N, 3)."""
        out = points - self.centre
        height = out @ self.axis
        if not self.angle:
            return height / self.length
        turn = np.arctan2(out @ np.cross(self.axis, self.ahead), out @ self.ahead)
        if not self.advance:
            return np.where(turn < self.angle / 2 - np.pi, turn + 2 * np.pi, turn) / self.angle
        whole = np.round((height / self.advance * self.angle - turn) / (2 * np.pi))
        share = (turn + 2 * np.pi * whole) / self.angle
        for _ in range(NEWTON):  # the first plane is not parallel to the axis
            back = self.move(points, -share) - self.centre
            speed = self.angle * np.cross(self.axis, back) + self.advance * self.axis
            share = share + back @ self.normal / (speed @ self.normal)
        return share


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
    x, size = surface.vertices, diagonal(surface)
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
        chord = np.linalg.norm(np.diff(lines, axis=1)[:, 0], axis=1).max()
        wall = np.isin(surface.region, list(group))
        used = np.unique(surface.faces[wall])
        for motion in _motions(surface, ends[here], normal, ends[after], wall):
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


def _motions(
    surface: TriMesh, here: np.ndarray, normal: np.ndarray, after: np.ndarray, wall: np.ndarray
) -> Iterator[Motion]:
    """The motions that may carry a curve in a plane to another one; edges (N, 2) and (M, 2).

    normal : (3,) of the first plane.  wall : (F,) whether a triangle is between the curves

    Raises
    ------
    NoBackgroundError
        If the other curve is not plane, or is about the same centre.
    """
    x = surface.vertices
    centre, target = x[here].mean(axis=(0, 1)), x[after].mean(axis=(0, 1))
    out = x[np.unique(after)] - target
    _, _, axes = np.linalg.svd(out, full_matrices=False)
    other, step = axes[2], target - centre
    length = np.linalg.norm(step)
    extent = abs(out).max()
    if abs(out @ other).max() > 1e-4 * extent or length < 1e-4 * extent:
        raise NoBackgroundError("its section is not constant along a path")
    axis, ends = np.cross(normal, other), (centre, target, normal)
    if np.linalg.norm(axis) > PARALLEL:
        axis /= np.linalg.norm(axis)
        planes = np.stack([normal, other, axis])
        foot = np.linalg.solve(planes, [centre @ normal, target @ other, centre @ axis])
        yield _turn(*ends, axis, foot)
    elif normal @ step < 1e-3 * length:  # a half turn
        yield _turn(*ends, np.cross(normal, step) / length, (centre + target) / 2)
    else:
        forward = float(step @ normal)
        yield Motion(normal, centre, step / length, 0.0, forward, forward, normal)
    if (found := _screw(surface, wall)) is not None:
        yield _turn(*ends, *found)


def _turn(
    centre: np.ndarray,
    target: np.ndarray,
    normal: np.ndarray,
    axis: np.ndarray,
    foot: np.ndarray,
    pitch: float = 0.0,
) -> Motion:
    """The rotation of a centre to a target about an axis through a foot.

    normal : (3,) of the plane of the centre.  pitch : advance along the axis for each radian
    """
    foot = foot + axis * ((centre - foot) @ axis)
    radius = float(np.linalg.norm(centre - foot))
    ahead = (centre - foot) / radius
    axis = axis * np.sign(np.cross(axis, ahead) @ normal)
    end = target - foot
    angle = float(np.arctan2(end @ np.cross(axis, ahead), end @ ahead) % (2 * np.pi))
    if not pitch:
        return Motion(axis, foot, ahead, angle, radius * angle, 0.0, normal)
    advance = float(end @ axis)
    angle += 2 * np.pi * np.round((advance / pitch - angle) / (2 * np.pi))
    return Motion(axis, foot, ahead, angle, np.hypot(radius * angle, advance), advance, normal)


def _screw(surface: TriMesh, wall: np.ndarray) -> tuple[np.ndarray, np.ndarray, float] | None:
    """Axis, a point of it, and advance for each radian, of the screw motion of a helical surface.

    Its velocities are as tangential as possible at the edges inside faces, with the mean normals
    of their triangles: Pottmann and Randrup 1998. None if it is a translation or a rotation.

    wall : (F,) whether a triangle is on the surface
    """
    faces, region, each = surface.faces[wall], surface.region[wall], area_vectors(surface)[wall]
    one, two = twins(faces)
    inside = region[one // 3] == region[two // 3]
    at = surface.vertices[half_edges(faces)[one[inside]]].mean(axis=1)
    normal = each[one[inside] // 3] + each[two[inside] // 3]
    middle, extent = at.mean(axis=0), np.ptp(at)
    rows = np.concatenate([np.cross((at - middle) / extent, normal), normal], axis=1)
    spin, shift = np.linalg.eigh(rows.T @ rows)[1][:, 0].reshape(2, 3)
    square, along = spin @ spin, spin @ shift
    if min(square, abs(along)) < PARALLEL**2:
        return None
    foot = middle + extent * np.cross(spin, shift) / square
    return spin / np.sqrt(square), foot, float(extent * along / square)


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
