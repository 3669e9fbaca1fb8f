"""Motions that carry a plane section along a path: translations, rotations and screw motions."""

from typing import NamedTuple

import numpy as np

from polycube.hexmesh.background.curves import Sizes
from polycube.surface.measures import area_vectors, half_edges, twins
from polycube.types import TriMesh

PARALLEL = 1e-4  # sine: tolerance for parallel planes
SHIFT = 1e-3  # of the extent: advance for each radian of a rotation
UNIQUE = 0.02  # ratio of the mean squares of normal velocities of a rotation and of others
TURN = np.pi / 8  # largest angle of an edge along an arc
NEWTON = 4  # steps to the plane of a point


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


def edges_in_bend(sizes: Sizes, radius: float, angle: float) -> float:
    """Smallest number of edges along an arc, not rounded."""
    return angle * max(sizes.around(radius) / (2 * np.pi), 1 / TURN)


def turn(
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


def screw(surface: TriMesh, wall: np.ndarray) -> tuple[np.ndarray, np.ndarray, float] | None:
    """Axis, a point of it, and advance for each radian, of the screw motion of a helical surface.

    Its velocities are as tangential as possible at the edges inside faces, with the mean normals
    of their triangles: Pottmann and Randrup 1998. None if it is a translation or a rotation.

    wall : (F,) whether a triangle is on the surface
    """
    spin, foot, along, _ = _tangential(surface, wall)
    square = spin @ spin
    if min(square, abs(along)) < PARALLEL**2:
        return None
    return spin / np.sqrt(square), foot, along / square


def rotation(surface: TriMesh, wall: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Axis of the rotation that moves a wall (F,) along itself, and a point of the axis.

    None if there is no such rotation, or if other motions do so, too, as on planes and cylinders.
    """
    spin, foot, along, (least, next_) = _tangential(surface, wall)
    size = np.linalg.norm(spin)
    is_rotation = abs(along) < SHIFT * np.ptp(surface.vertices[surface.faces[wall]]) * size**2
    return (spin / size, foot) if is_rotation and least < UNIQUE * next_ else None


def _tangential(
    surface: TriMesh, wall: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float, np.ndarray]:
    """The most tangential motion of a surface, as in `screw`.

    Returns its angular velocity (3,), a point (3,) of its axis, the product of both velocities, and
    the mean square of the normal velocity (2,) of this motion and of the next one.
    """
    faces, region, each = surface.faces[wall], surface.region[wall], area_vectors(surface)[wall]
    one, two = twins(faces)
    inside = region[one // 3] == region[two // 3]
    at = surface.vertices[half_edges(faces)[one[inside]]].mean(axis=1)
    normal = each[one[inside] // 3] + each[two[inside] // 3]
    middle, extent = at.mean(axis=0), np.ptp(at)
    rows = np.concatenate([np.cross((at - middle) / extent, normal), normal], axis=1)
    values, vectors = np.linalg.eigh(rows.T @ rows)
    spin, shift = vectors[:, 0].reshape(2, 3)
    foot = middle + extent * np.cross(spin, shift) / max(spin @ spin, PARALLEL**4)
    return spin, foot, float(extent * (spin @ shift)), values[:2]
