"""The axis about which most of a surface is turned."""

from dataclasses import dataclass

import numpy as np

from polycube.hexmesh.background.background import NoBackgroundError
from polycube.surface.measures import (
    between_faces,
    curved_faces,
    diagonal,
    face_areas,
    face_normals,
    frame,
    half_edges,
)
from polycube.types import TriMesh

OFF = np.geomspace(0.5, 0.02, 12)  # sine off the axis at which a triangle has half its weight
EXACT = 1e-5  # of the diagonal: largest distance of points from a plane and a circle
ROUGH = 0.2  # tolerance of the first axis: sine, and share of the diagonal
FEWEST = 6  # points on a circle


@dataclass(frozen=True, eq=False)
class Axis:
    """An axis of rotation."""

    origin: np.ndarray  # (3,) a point on it
    frame: np.ndarray  # (3, 3) right-handed rows, the last along the axis

    def cylindrical(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates (N, 2) along the axis and from it, (z, r), and angles (N,) of points."""
        x, y, z = ((points - self.origin) @ self.frame.T).T
        return np.stack([z, np.hypot(x, y)], axis=1), np.arctan2(y, x)

    def place(self, turned: np.ndarray) -> np.ndarray:
        """Points (N, 3) with the coordinates z, r and angle (N, 3)."""
        z, r, angle = turned.T
        local = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)
        return local @ self.frame + self.origin


def main_axis(surface: TriMesh) -> Axis:
    """The axis about which the largest area is turned.

    The normals of a turned surface meet its axis: c . (p x n) + d . n = 0 for the points p, the
    axis c and its moment d (Pottmann and Wallner, *Computational line geometry*, 2001). The curved
    faces give a first axis; then triangles whose normals do not meet it lose weight.

    Raises NoBackgroundError if there are no CAD faces, or if all are plane.
    """
    if not len(surface.region):
        raise NoBackgroundError("it has no CAD faces")
    scale, middle = diagonal(surface), surface.vertices.mean(axis=0)
    area, normal = face_areas(surface), face_normals(surface)
    place = (surface.vertices[surface.faces].mean(axis=1) - middle) / scale
    weight = area * curved_faces(surface)[surface.region]
    if not weight.any():
        raise NoBackgroundError("all its faces are plane")
    lines = np.hstack([normal, np.cross(place, normal)])
    for off in OFF:
        square = (lines * weight[:, None]).T @ lines
        moment = -np.linalg.pinv(square[:3, :3], rcond=1e-9) @ square[:3, 3:]
        axis = np.linalg.eigh(square[3:, 3:] + square[3:, :3] @ moment)[1][:, 0]
        motion = moment @ axis
        origin = np.cross(axis, motion)
        radius = np.linalg.norm(np.cross(axis, place - origin), axis=1)
        sine = abs(lines @ np.append(motion, axis)) / np.maximum(radius, 1e-9)
        weight = area / (1 + (sine / off) ** 2)
    return _exact(surface, axis, origin * scale + middle)


def _exact(surface: TriMesh, axis: np.ndarray, origin: np.ndarray) -> Axis:
    """The axis of the largest circle between two faces about an axis."""
    sides, others = between_faces(surface)
    between = np.sort(surface.region[np.stack([sides // 3, others // 3], axis=1)], axis=1)
    ends, unit = half_edges(surface.faces)[sides], diagonal(surface)
    largest, best = 0.0, (np.zeros(3), _upward(axis))  # without circles: spheres and tori
    _, pair, number = np.unique(between, axis=0, return_inverse=True, return_counts=True)
    for own in np.split(ends[np.argsort(pair.ravel(), kind="stable")], np.cumsum(number)[:-1]):
        points = surface.vertices[np.unique(own)] - origin
        middle = points.mean(axis=0)
        if len(points) < FEWEST:
            continue
        rows = _upward(np.linalg.svd(points - middle)[2][2])
        x, y, z = ((points - middle) @ rows.T).T
        # a circle in a plane: x^2 + y^2 = 2 x x0 + 2 y y0 + c
        terms = np.stack([2 * x, 2 * y, np.ones(len(x))], axis=1)
        found = np.linalg.lstsq(terms, x**2 + y**2, rcond=1e-9)[0]
        off = max(np.ptp(z), abs(terms @ found - x**2 - y**2).max() / unit)
        radius = float(np.sqrt(max(found[2] + found[:2] @ found[:2], 0.0)))
        centre = middle + found[:2] @ rows[:2]
        away = np.linalg.norm(np.cross(centre, axis)) / unit
        tilt = np.linalg.norm(np.cross(rows[2], axis))
        if off < EXACT * unit and max(away, tilt) < ROUGH and radius > largest:
            largest, best = radius, (centre, rows)
    return Axis(origin + best[0], best[1])


def _upward(axis: np.ndarray) -> np.ndarray:
    """(3, 3) frame of an axis with a positive largest component; exact for a coordinate axis."""
    largest = np.argmax(abs(axis))
    axis = axis * np.sign(axis[largest])
    return frame(np.eye(3)[largest] if axis[largest] > 1 - EXACT**2 else axis)
