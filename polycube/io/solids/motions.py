"""Rigid motions, without reflections, from one CAD solid to another.

They are found from landmarks that do not depend on how a file was written: vertices, centroids of
edges and faces with their sizes, and the principal axes of inertia. Two landmarks of the first
solid and two similar landmarks of the second determine a motion, which must be valid for all
landmarks.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

SAME = 1e-5  # of the size of a solid: closer points are equal
EQUAL = 1e-4  # relative difference of volumes or moments of inertia
APART = 1e-3  # of the size: smallest distance of the landmarks for a motion from a line
DISTINCT = 1e-3  # of the moment of inertia: smallest difference to the next one for a unique axis
AXIS, VERTEX, EDGE, FACE = range(4)  # kinds of landmarks


@dataclass(frozen=True, eq=False)
class Motion:
    """The map x -> rotation @ x + translation."""

    rotation: np.ndarray  # (3, 3), of determinant 1
    translation: np.ndarray  # (3,)
    faces: np.ndarray  # (F,) face of the second solid for each face of the first, from 0

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Images of points (N, 3)."""
        return points @ self.rotation.T + self.translation


@dataclass(frozen=True, eq=False)
class Landmarks:
    """Properties of a solid that identify it in another position."""

    mass: np.ndarray  # (4,) volume, and principal moments of inertia
    centre: np.ndarray  # (3,) centre of mass
    points: np.ndarray  # (N, 3) relative to the centre
    keys: np.ndarray  # (N, 3) kind, size as a length, and a number for the kind of surface

    @property
    def size(self) -> float:
        """Distance of the farthest landmark from the centre."""
        return float(np.linalg.norm(self.points, axis=1).max())

    def described(self, size: float) -> np.ndarray:
        """(N, 4) invariants of motions: the keys and the distance from the centre."""
        away = np.linalg.norm(self.points, axis=1)[:, None] / size
        return np.hstack([self.keys * [1, 1 / size, 1], away])


def landmarks(
    volume: float, centre: np.ndarray, inertia: np.ndarray, points: np.ndarray, keys: np.ndarray
) -> Landmarks:
    """Landmarks of a solid, with those of its principal axes that are unique.

    centre : (3,) centre of mass
    inertia : (3, 3) about the centre
    points, keys : (N, 3) of vertices, edges and faces, in the coordinates of the file
    """
    points = points - centre
    moments, axes = np.linalg.eigh(inertia)
    gap = np.abs(moments[:, None] - moments)
    np.fill_diagonal(gap, np.inf)
    known = gap.min(axis=1) > DISTINCT * moments.max()
    ends = np.linalg.norm(points, axis=1).max(initial=0) * axes.T[known]
    named = np.stack([0 * moments, 0 * moments, np.arange(3)], axis=1)[known]
    points, keys = np.vstack([points, ends, -ends]), np.vstack([keys, named, named])
    return Landmarks(np.append(volume, moments), centre, points, keys.astype(float))


def motions(first: Landmarks, second: Landmarks) -> Iterator[Motion]:
    """Every motion from all landmarks of a solid to similar ones of another.

    Motions with the smallest rotation come first. There are none if the solids differ in size, or
    if all landmarks are on a line.
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
    similar = [there.query_ball_point(own[k], **within) for k in pair]
    places = cKDTree(np.hstack([second.points / size, other]))
    i, j = np.reshape(np.meshgrid(*similar, indexing="ij"), (2, -1))
    x, y = second.points[i], second.points[j]
    apart = np.linalg.norm(x - y, axis=1) - np.linalg.norm(u - v)
    fits = np.flatnonzero(np.abs(apart) <= 4 * SAME * size)
    turns = [Rotation.align_vectors([x[k], y[k]], [u, v])[0].as_matrix() for k in fits]
    for rotation in sorted(turns, key=np.trace, reverse=True):
        found = _fitted(first, second, rotation, places, own)
        if found is not None:
            yield found


def _pair(points: np.ndarray, count: np.ndarray) -> tuple[int, int] | None:
    """Two landmarks (N, 3), preferably of rare kinds, that are not collinear with the centre."""
    first = np.where(np.linalg.norm(points, axis=1) > APART, count, np.inf).argmin()
    aside = np.linalg.norm(np.cross(points[first], points), axis=1)
    second = np.lexsort([-aside, np.where(aside > APART, count, np.inf)])[0]
    return (int(first), int(second)) if aside[second] > APART else None


def _fitted(
    first: Landmarks, second: Landmarks, rotation: np.ndarray, places: cKDTree, own: np.ndarray
) -> Motion | None:
    """The motion of all landmarks close to a rotation about the centres; None if there is none.

    The rotation is replaced by the one that fits all landmarks best in the least-squares sense.
    """
    size = first.size
    moved = np.hstack([first.points @ rotation.T / size, own])
    partner = places.query(moved, p=np.inf)[1]
    rotation = Rotation.align_vectors(second.points[partner], first.points)[0].as_matrix()
    moved = np.hstack([first.points @ rotation.T / size, own])
    off, partner = places.query(moved, p=np.inf)
    if max(off.max(), cKDTree(moved).query(places.data, p=np.inf)[0].max()) > SAME:
        return None
    faces = (np.cumsum(second.keys[:, 0] == FACE) - 1)[partner[first.keys[:, 0] == FACE]]
    if len(np.unique(faces)) < len(faces):
        return None
    return Motion(rotation, second.centre - rotation @ first.centre, faces)
