"""Coordinate frames in which a part may be close to a polycube.

A frame is good if the normals of the surface lie along its axes and its bounding box is small:

    J(R) = log sum_f a_f |R n_f|_1 + 1/3 log volume(box(R x)),    |t| = sqrt(t^2 + 1e-4).

The descent is started from several frames, because no single start is sufficient for every part;
distinct results are returned.
"""

import itertools
from collections.abc import Callable
from functools import cache, lru_cache

import numpy as np
from scipy.optimize import minimize
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from polycube.surface.measures import area_vectors
from polycube.types import TriMesh

SAME = np.cos(np.radians(10))  # frames are the same if their axes agree, in any order and sense


@cache
def rotations() -> np.ndarray:
    """(24, 3, 3) the rotations of the cube, read-only."""
    signed = [
        np.eye(3)[list(order)] * np.array(signs)[:, None]
        for order in itertools.permutations(range(3))
        for signs in itertools.product([1, -1], repeat=3)
    ]
    found = np.array([matrix for matrix in signed if np.linalg.det(matrix) > 0])
    found.flags.writeable = False
    return found


def turn(boxes: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Express (X, Y, Z) boxes in axes rotated by one of the rotations of the cube."""
    order = np.abs(rotation).argmax(axis=1)
    return np.flip(np.transpose(boxes, order), tuple(np.flatnonzero(rotation.sum(axis=1) < 0)))


@lru_cache(maxsize=2)  # several plugins need those of the same surface
def frames(surface: TriMesh) -> list[np.ndarray]:
    """Rotations (3, 3) whose rows are the axes of a frame, best first, without duplicates."""
    import trimesh

    hull = surface.vertices[ConvexHull(surface.vertices).vertices]
    hull = (hull - hull.mean(axis=0)) / np.ptp(hull, axis=0).max()
    normals, areas = _normals(surface)
    # axes of the smallest bounding box with a side on the convex hull
    box = trimesh.bounds.oriented_bounds(hull)[0][:3, :3]
    main, box = _inertia_axes(surface), box * np.sign(np.linalg.det(box))
    quarter = [Rotation.from_rotvec(np.pi / 4 * np.eye(3)[axis]).as_matrix() for axis in (2, 0)]
    starts = [main, box, *(turn @ box for turn in quarter)]

    def misfit(rotation: np.ndarray) -> float:
        spread = areas @ np.sqrt((normals @ rotation.T) ** 2 + 1e-4).sum(axis=1)
        return np.log(spread) + np.log(np.ptp(hull @ rotation.T, axis=0)).sum() / 3

    found = [_descend(misfit, start) for start in starts]
    distinct: list[np.ndarray] = []
    for rotation in (min([*found, *starts], key=misfit), found[0], main, box):
        if not any((np.abs(rotation @ each.T).max(axis=1) > SAME).all() for each in distinct):
            distinct.append(rotation)
    return distinct


def _normals(surface: TriMesh) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals (N, 3) up to sign, with similar ones merged, and their shares of the area."""
    vectors = area_vectors(surface)
    areas = np.linalg.norm(vectors, axis=1)
    unit = vectors[areas > 0] / areas[areas > 0, None]
    bins, index = np.unique(np.round(unit * 16).astype(int), axis=0, return_inverse=True)
    total = np.zeros(bins.shape)
    np.add.at(total, index.ravel(), vectors[areas > 0])
    size = np.linalg.norm(total, axis=1)
    return total / size[:, None], size / size.sum()


def _inertia_axes(surface: TriMesh) -> np.ndarray:
    """Principal axes of the solid, as a rotation; the longest is the last."""
    corners = surface.vertices[surface.faces] - surface.vertices.mean(axis=0)
    volumes = np.linalg.det(corners) / 6  # of the tetrahedra with the origin
    centre = (volumes[:, None] * corners.sum(axis=1) / 4).sum(axis=0) / volumes.sum()
    sums = corners.sum(axis=1)
    second = np.einsum("f,fi,fj->ij", volumes / 20, sums, sums)
    second += np.einsum("f,fki,fkj->ij", volumes / 20, corners, corners)
    axes = np.linalg.eigh(second / volumes.sum() - np.outer(centre, centre))[1].T
    return axes * np.sign(np.linalg.det(axes))


def _descend(misfit: Callable[[np.ndarray], float], start: np.ndarray) -> np.ndarray:
    """Rotation near `start` with the smallest misfit (simplex search over rotation vectors)."""

    def turned(vector: np.ndarray) -> np.ndarray:
        return Rotation.from_rotvec(vector).as_matrix() @ start

    simplex = np.vstack([np.zeros(3), 0.15 * np.eye(3)])
    options = {"initial_simplex": simplex, "maxiter": 120, "xatol": 1e-3, "fatol": 1e-5}
    search = {"method": "Nelder-Mead", "options": options}
    return turned(minimize(lambda vector: misfit(turned(vector)), simplex[0], **search).x)
