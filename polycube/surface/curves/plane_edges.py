"""Edges at which two planes of a surface meet at a small angle: chamfers, wedges and draft.

At small angles, the angle alone does not distinguish an edge of the part from the edges between the
facets of a round surface. Facets are consecutive: three parallel edges in a row with similar turns
belong to a bend.
"""

import numpy as np

from polycube.surface.measures import connected, face_areas
from polycube.types import TriMesh

FLAT = np.cos(np.radians(1))  # for normals in one plane
LEAST = np.radians(36)  # smallest turn between two planes that can be an edge
LARGE = 8e-3  # smallest share of the area that makes a plane
MACHINED = 0.5  # smallest share of the area in such planes; below it, no edges are searched
SIMILAR = 0.3  # relative difference of the turns of the edges of a bend
PARALLEL = np.cos(np.radians(20))  # for the directions of the edges of a bend


def between_planes(
    surface: TriMesh, normals: np.ndarray, pairs: np.ndarray, most: float
) -> np.ndarray:
    """Find the edges between two planes, excluding those between facets.

    Parameters
    ----------
    surface : a triangle surface
    normals : (F, 3) unit normals of its triangles
    pairs : (E, 2) triangles at each edge
    most : turn in radians above which an edge is sharp without this test

    Returns
    -------
    (E,) bool
    """
    cosine = np.einsum("ed,ed->e", normals[pairs[:, 0]], normals[pairs[:, 1]])
    first, second = pairs[cosine > FLAT].T
    plane = connected(first, second, len(normals))
    areas = face_areas(surface)
    share = np.bincount(plane, areas) / areas.sum()
    is_large = share >= LARGE
    found = np.zeros(len(pairs), bool)
    if share[is_large].sum() < MACHINED:
        return found
    turn = np.arccos(np.clip(cosine, -1, 1))
    planes = plane[pairs]
    weak = (turn > LEAST / 2) & (turn <= most) & (planes[:, 0] != planes[:, 1])
    weak &= is_large[planes].all(axis=1)
    sides, index = np.unique(np.sort(planes[weak], axis=1), axis=0, return_inverse=True)
    _, at = np.unique(index, return_index=True)
    axis = np.cross(*normals[pairs[weak][at]].transpose(1, 0, 2))
    axis[(planes[weak][at] != sides).any(axis=1)] *= -1  # from the first of `sides` to the second
    found[weak] = ~_in_bends(sides, axis)[index.ravel()]
    return found & (turn > LEAST)


def _in_bends(sides: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """(S,) borders between planes that belong to three or more in a row with similar turns.

    sides : (S, 2) planes
    axis : (S, 3) cross product of their normals: axis of the turn, its length the sine of the turn
    """
    turn = np.linalg.norm(axis, axis=1)
    along = axis / turn[:, None]
    after: list[list[int]] = [[] for _ in sides]  # borders that continue the row, on either side
    count = np.zeros((len(sides), 2), np.int64)
    by_plane: dict[int, list[tuple[int, int]]] = {}
    for border, pair in enumerate(sides.tolist()):
        for end, plane in enumerate(pair):
            by_plane.setdefault(plane, []).append((border, end))
    for borders in by_plane.values():
        for a, enda in borders:
            for b, endb in borders:
                # whether both turn in the same sense along the row
                sign = 1 if enda != endb else -1
                if (
                    a != b
                    and sign * (along[a] @ along[b]) > PARALLEL
                    and abs(turn[a] - turn[b]) < SIMILAR * max(turn[a], turn[b])
                ):
                    after[a].append(b)
                    count[a, enda] += 1
    middle = (count > 0).all(axis=1)  # at least one border on each side
    found = middle.copy()
    for border in np.flatnonzero(middle).tolist():
        found[after[border]] = True
    return found
