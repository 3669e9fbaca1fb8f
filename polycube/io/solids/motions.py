"""Rigid motions that take a CAD solid onto another one, without a reflection.

They are found by landmarks that do not depend on how a file was written: vertices, the centroids of
edges and faces with their sizes, and the principal axes of inertia.  Two landmarks of the first
solid and two of the second that look alike give a motion, which must take all others along.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

SAME = 1e-5  # of the size of a solid: what lies this near is at one place
EQUAL = 1e-4  # of a volume or a moment of inertia
APART = 1e-3  # of the size: landmarks that give a motion are this far from a line, at least
DISTINCT = 1e-3  # of the moment of inertia: between one and the next, where an axis is known
AXIS, VERTEX, EDGE, FACE = range(4)  # kinds of landmark


@dataclass(frozen=True, eq=False)
class Motion:
    """x -> rotation @ x + translation.

    Parameters
    ----------
    rotation : (3, 3), of determinant 1
    translation : (3,)
    faces : (F,) face of the second solid that each face of the first comes to, from 0
    """

    rotation: np.ndarray
    translation: np.ndarray
    faces: np.ndarray

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Where points (N, 3) come to."""
        return points @ self.rotation.T + self.translation


@dataclass(frozen=True, eq=False)
class Landmarks:
    """What is known of a solid, so that it is recognized in another place.

    Parameters
    ----------
    mass : (4,) volume, and principal moments of inertia
    centre : (3,) of mass
    points : (N, 3) relative to it
    keys : (N, 3) kind, size as a length, and a number of the kind of surface
    """

    mass: np.ndarray
    centre: np.ndarray
    points: np.ndarray
    keys: np.ndarray

    @property
    def size(self) -> float:
        """Distance of the farthest landmark from the centre."""
        return float(np.linalg.norm(self.points, axis=1).max())

    def described(self, size: float) -> np.ndarray:
        """(N, 4) what no motion changes: the keys and the distance from the centre."""
        away = np.linalg.norm(self.points, axis=1)[:, None] / size
        return np.hstack([self.keys * [1, 1 / size, 1], away])


def landmarks(
    volume: float, centre: np.ndarray, inertia: np.ndarray, points: np.ndarray, keys: np.ndarray
) -> Landmarks:
    """Landmarks of a solid, with its principal axes as far as they are known.

    Parameters
    ----------
    centre : (3,) of mass
    inertia : (3, 3) about it
    points, keys : (N, 3) of vertices, edges and faces, in the coordinates of the file
    """
    points = points - centre
    moments, axes = np.linalg.eigh(inertia)
    gap = np.abs(moments[:, None] - moments)
    np.fill_diagonal(gap, np.inf)
    known = gap.min(axis=1) > DISTINCT * moments.max()
    ends = np.linalg.norm(points, axis=1).max(initial=0) * axes.T[known]
    named = np.stack([0 * moments, 0 * moments, np.arange(3)], axis=1)[known]
    return Landmarks(
        np.append(volume, moments),
        centre,
        np.vstack([points, ends, -ends]),
        np.vstack([keys, named, named]).astype(float),
    )


def motions(first: Landmarks, second: Landmarks) -> Iterator[Motion]:
    """Every motion that takes all landmarks of a solid to alike ones of another, one by one.

    Those that turn the solid least come first.  There are none where the solids are of another
    size, or their landmarks are all on a line.
    """
    size = first.size
    if len(first.points) != len(second.points) or abs(second.size - size) > SAME * size:
        return
    if not np.allclose(first.mass, second.mass, rtol=EQUAL, atol=0):
        return
    own, other = first.described(size), second.described(size)
    known, there = cKDTree(own), cKDTree(other)
    within = {"r": SAME, "p": np.inf}
    count = known.query_ball_point(own, return_length=True, **within)
    if (count != there.query_ball_point(own, return_length=True, **within)).any():
        return
    pair = _pair(first.points / size, count)
    if pair is None:
        return
    u, v = first.points[list(pair)]
    alike = [there.query_ball_point(own[k], **within) for k in pair]
    places = cKDTree(np.hstack([second.points / size, other]))
    i, j = np.reshape(np.meshgrid(*alike, indexing="ij"), (2, -1))
    x, y = second.points[i], second.points[j]
    apart = np.linalg.norm(x - y, axis=1) - np.linalg.norm(u - v)
    fits = np.flatnonzero(np.abs(apart) <= 4 * SAME * size)
    turns = [_frame(x[k], y[k]) @ _frame(u, v).T for k in fits]
    for rotation in sorted(turns, key=np.trace, reverse=True):
        found = _fitted(first, second, rotation, places, own)
        if found is not None:
            yield found


def _pair(points: np.ndarray, count: np.ndarray) -> tuple[int, int] | None:
    """Two landmarks (N, 3) that are not on a line with the centre, of those that are rare."""
    off = np.flatnonzero(np.linalg.norm(points, axis=1) > APART)
    if not len(off):
        return None
    first = off[count[off].argmin()]
    aside = np.linalg.norm(np.cross(points[first], points), axis=1)
    off = np.flatnonzero(aside > APART)
    if not len(off):
        return None
    second = off[np.lexsort([-aside[off], count[off]])[0]]
    return int(first), int(second)


def _frame(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """(3, 3) right-handed unit axes as columns: along u, across u and v, and the third."""
    across = np.cross(u, v)
    axes = np.stack([u, across, np.cross(u, across)], axis=1)
    return axes / np.linalg.norm(axes, axis=0)


def _fitted(
    first: Landmarks,
    second: Landmarks,
    rotation: np.ndarray,
    places: cKDTree,
    own: np.ndarray,
) -> Motion | None:
    """The motion of all landmarks that is near a rotation about the centres; None without one."""
    size = first.size
    rotation = _nearest(first, second, rotation, places, own)
    moved = np.hstack([first.points @ rotation.T / size, own])
    off, partner = places.query(moved, p=np.inf)
    back = cKDTree(moved).query(places.data, p=np.inf)[0]
    if max(off.max(), back.max()) > SAME:
        return None
    is_face = first.keys[:, 0] == FACE
    number = np.cumsum(second.keys[:, 0] == FACE) - 1
    faces = number[partner[is_face]]
    if len(np.unique(faces)) < len(faces):
        return None
    return Motion(rotation, second.centre - rotation @ first.centre, faces)


def _nearest(
    first: Landmarks,
    second: Landmarks,
    rotation: np.ndarray,
    places: cKDTree,
    own: np.ndarray,
) -> np.ndarray:
    """The rotation that fits all landmarks best, in the sense of least squares (Kabsch)."""
    moved = np.hstack([first.points @ rotation.T / first.size, own])
    partner = places.query(moved, p=np.inf)[1]
    u, _, v = np.linalg.svd(second.points[partner].T @ first.points)
    return u @ np.diag([1, 1, np.sign(np.linalg.det(u @ v))]) @ v
