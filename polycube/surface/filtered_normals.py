"""Turn of a surface at an edge, by averaged normals and at planes that meet at a small angle.

Normals averaged over half a hex on either side distinguish an edge between two faces of the part
from the rim of a groove, a rib or a fold caused by noise, where both averages agree.
"""

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from polycube.surface.measures import connected, face_areas, spread, unit
from polycube.types import TriMesh

POINTS = 100  # sample points of the surface in a flat disc of the given width
MOST = 100_000  # largest number of sample points
ROWS = 10_000  # number of edges or faces in one batch, which limits memory
FEW = 0.1  # of the area: noise on a smaller share is not filtered
FLAT = np.cos(np.radians(1))  # for normals in one plane
LEAST = np.radians(36)  # smallest turn between two planes that can be an edge
LARGE = 8e-3  # smallest share of the area that makes a plane
MACHINED = 0.5  # smallest share of the area in such planes; below it, no edges are searched
SIMILAR = 0.3  # relative difference of the turns of the edges of a bend
PARALLEL = np.cos(np.radians(20))  # for the directions of the edges of a bend


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
        is_right = np.einsum("nd,nd->n", points[point] - start[edge], across[edge]) > 0
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
    return np.concatenate([function(part) for part in np.array_split(rows, 1 + len(rows) // ROWS)])


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


def between_planes(
    surface: TriMesh, normals: np.ndarray, pairs: np.ndarray, most: float
) -> np.ndarray:
    """Find the edges between two planes, excluding those between facets.

    Returns (E,) bool.

    normals : (F, 3) unit normals of its triangles
    pairs : (E, 2) triangles at each edge
    most : turn in radians above which an edge is sharp without this test
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
