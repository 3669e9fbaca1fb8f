"""Faces of a surface that cross each other.

libigl finds the faces with a common point by exact predicates. Faces with a common edge, and faces
that only touch, do not count as crossing.
"""

import numpy as np

from polycube.errors import InputError
from polycube.surface.measures import connected, diagonal
from polycube.types import TriMesh

TOUCH = 1e-10  # of the diagonal: an end this close to a plane is taken to be on it
MOST = 40_000_000  # comparisons of sides of boxes, in about a second
OF_FACE = 150  # comparisons for each face that are always made; a scan needs about 50
SAMPLES = 64  # faces from which the number of comparisons is estimated
BATCH = 50_000  # pairs of faces that are tested at once


def self_intersections(surface: TriMesh) -> np.ndarray:
    """(N, 2) pairs of faces that cross, ascending.

    The work grows as F log F; raises InputError if the boxes of too many faces overlap.
    """
    corners = (surface.vertices[surface.faces] - surface.vertices.mean(axis=0)) / diagonal(surface)
    low, high = corners.min(axis=1), corners.max(axis=1)
    chosen = np.linspace(0, len(corners) - 1, min(SAMPLES, len(corners))).astype(int)
    near = [((low <= high[i]) & (low[i] <= high)).all(axis=1).sum() for i in chosen]
    # six for each pair of faces whose boxes overlap
    if float(3 * len(corners) * np.mean(near)) > max(MOST, OF_FACE * len(corners)):
        why = f"too many of the {len(surface.faces)} faces lie close to many others"
        raise InputError(f"intersecting faces were not searched for: {why}")
    pairs = meeting(surface.vertices, surface.faces, 1)
    parts = np.array_split(pairs, 1 + len(pairs) // BATCH)
    return np.concatenate([part[_pierces(corners[part])] for part in parts])


def meeting(vertices: np.ndarray, faces: np.ndarray, shared: int) -> np.ndarray:
    """(N, 2) pairs i < j of triangles (F, 3) with a common point, in lexical order.

    shared : pairs with more common vertices do not count, and others only for other common points
    """
    from igl.predicates import find_self_intersections

    pairs = find_self_intersections(np.ascontiguousarray(vertices), np.ascontiguousarray(faces))[1]
    pairs = np.sort(pairs.reshape(-1, 2), axis=1)
    first, second = faces[pairs].transpose(1, 0, 2)
    pairs = pairs[(first[:, :, None] == second[:, None]).sum(axis=(1, 2)) <= shared]
    return pairs[np.lexsort(pairs.T[::-1])]


def _pierces(corners: np.ndarray) -> np.ndarray:
    """(N,) whether an edge of one triangle passes through the other in pairs (N, 2, 3, 3)."""
    one, other = np.concatenate([corners, corners[:, ::-1]]).transpose(1, 0, 2, 3)
    along = np.roll(other, -1, axis=1) - other
    normal = np.cross(along[:, 0], -along[:, 2])
    level = np.einsum("nkd,nd->nk", one - other[:, :1], normal)
    ends = np.roll(level, -1, axis=1)
    least = TOUCH * np.linalg.norm(normal, axis=1)[:, None]
    passes = (np.minimum(abs(level), abs(ends)) > least) & (level * ends < 0)
    share = np.divide(level, level - ends, out=np.zeros_like(level), where=passes)
    place = one + share[:, :, None] * (np.roll(one, -1, axis=1) - one)
    turned = np.cross(along[:, None], place[:, :, None] - other[:, None])
    inside = (np.einsum("nkcd,nd->nkc", turned, normal) >= 0).all(axis=2)
    return (passes & inside).any(axis=1).reshape(2, -1).any(axis=0)


def crossing_places(surface: TriMesh, pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Centre of a face (P, 3) for each place where faces cross, and number of pairs (P,),
    descending.

    pairs : (N, 2) of `self_intersections`; pairs whose faces share a vertex are one place
    """
    involved, local = np.unique(pairs, return_inverse=True)
    local, faces = local.reshape(-1, 2), surface.faces[involved]
    n, size = len(involved), len(involved) + len(surface.vertices)
    first = np.concatenate([local[:, 0], np.repeat(np.arange(n), 3)])
    second = np.concatenate([local[:, 1], n + faces.ravel()])
    _, place = np.unique(connected(first, second, size)[:n], return_inverse=True)
    count = np.bincount(place[local[:, 0]])
    middles = surface.vertices[faces].mean(axis=1)
    found = []
    for number in np.argsort(-count, kind="stable"):
        own = middles[place == number]  # the most central one: the mean of a ring is in its hole
        found.append(own[np.linalg.norm(own - own.mean(axis=0), axis=1).argmin()])
    return np.reshape(found, (-1, 3)), -np.sort(-count)
