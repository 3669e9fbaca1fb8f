"""Turn of a surface at an edge, measured with averaged normals.

Normals averaged over half a hex on either side distinguish an edge between two faces of the part
from the rim of a groove, a rib or a fold caused by noise, where both averages agree.
"""

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from polycube.surface.measures import face_areas, spread, unit
from polycube.types import TriMesh

POINTS = 100  # sample points of the surface in a flat disc of the given width
MOST = 100_000  # largest number of sample points
ROWS = 10_000  # number of edges or faces in one batch, which limits memory
FEW = 0.1  # of the area: noise on a smaller share is not filtered


def broad_turns(
    surface: TriMesh, normals: np.ndarray, sides: np.ndarray, width: float
) -> np.ndarray:
    """(S,) angle between the averaged normals on the two sides of the edges.

    surface, normals : at unit scale, (F, 3)
    sides : (S, 2) ends of the edges
    width : radius around the middle of an edge within which normals are averaged

    The plane of the edge and of the mean normal separates the two sides. If one side has no points,
    the angle is pi, which means unknown.
    """
    if len(sides) == 0:
        return np.zeros(0)
    points, face = _points(surface, width)
    tree = cKDTree(points)

    def turns(sides: np.ndarray) -> np.ndarray:
        start, end = surface.vertices[sides[:, 0]], surface.vertices[sides[:, 1]]
        along = unit(end - start)
        edge, point = _near(tree, (start + end) / 2, width)
        facing = normals[face[point]]
        facing -= np.einsum("nd,nd->n", facing, along[edge])[:, None] * along[edge]
        across = np.cross(along, _sums(edge, facing, len(sides)))
        off = points[point] - start[edge]
        is_right = np.einsum("nd,nd->n", off, across[edge]) > 0
        a, b = (_sums(edge[on], facing[on], len(sides)) for on in (is_right, ~is_right))
        turn = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("nd,nd->n", a, b))
        return np.where((a == 0).all(axis=1) | (b == 0).all(axis=1), np.pi, turn)

    return _in_turn(turns, sides)


def steady_normals(
    surface: TriMesh, normals: np.ndarray, noise: np.ndarray, width: float
) -> np.ndarray:
    """(F, 3) normals; at the ends of noisy edges, the average within a width of the face.

    noise : (N, 2) ends of those edges

    The normal of a sliver that is folded by noise is arbitrary, so the average of its surroundings
    is used. If only a small part of the surface is noisy, the normals are returned unchanged.
    """
    is_rough = np.isin(surface.faces, noise).any(axis=1)
    area = face_areas(surface)
    if area[is_rough].sum() <= FEW * area.sum():
        return normals
    points, face = _points(surface, width)
    tree = cKDTree(points)

    def means(rough: np.ndarray) -> np.ndarray:
        which, point = _near(tree, surface.vertices[surface.faces[rough]].mean(axis=1), width)
        mean = _sums(which, normals[face[point]], len(rough))
        return np.where((mean == 0).all(axis=1)[:, None], normals[rough], unit(mean))

    steady = normals.copy()
    steady[is_rough] = _in_turn(means, np.flatnonzero(is_rough))
    return steady


def _in_turn(function: Callable[[np.ndarray], np.ndarray], rows: np.ndarray) -> np.ndarray:
    """Evaluate a function in batches of rows, each of which uses about a hundred points."""
    parts = np.array_split(rows, 1 + len(rows) // ROWS)
    return np.concatenate([function(part) for part in parts])


def _near(tree: cKDTree, places: np.ndarray, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (P,), (P,) of a place and a point within the width, in the order of the places."""
    near = tree.query_ball_point(places, width)
    place = np.repeat(np.arange(len(places)), [len(found) for found in near])
    return place, np.concatenate(near).astype(np.int64)


def _points(surface: TriMesh, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) evenly distributed, `POINTS` in a disc of the width, and their faces (N,)."""
    discs = face_areas(surface).sum() / (np.pi * width**2)
    return spread(surface, min(int(POINTS * discs), MOST))


def _sums(group: np.ndarray, vectors: np.ndarray, number: int) -> np.ndarray:
    """(number, 3) sums of the vectors of each group."""
    return np.stack([np.bincount(group, column, number) for column in vectors.T], axis=1)
