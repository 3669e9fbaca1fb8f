"""Exact closest points on triangles with compatible normals: a box tree of points and normals.

Minimises |x - p|^2 + alpha^2 max(|n - n_f|^2 - free, 0) over the points p of all triangles f. With
alpha = 0 this is the closest point. The boxes bound positions and normals together, so the search
is exact for every alpha. A triangle (a, b, b) is a segment, whose direction is stored instead of
the normal. There is also a tree for each group of triangles, so that the search for a point can be
limited to one group.
No library has the normals in the metric.
"""

from functools import partial

import numpy as np

from polycube.numerics.threads import parts, side_by_side
from polycube.surface.box_tree import Tree, boxes, build, search

LEAST = 300  # smallest number of points for a thread


def tree(
    corners: np.ndarray, normals: np.ndarray | None = None, group: np.ndarray | None = None
) -> Tree:
    """Build a box tree of triangles (T, 3, 3), and one for each group of them.

    normals : (T, 3), if normals are compared
    group : (T,) numbers from 1 on; a triangle of group 0 belongs to no group
    """
    corners = np.ascontiguousarray(corners, np.float64)
    normals = np.zeros((len(corners), 3)) if normals is None else normals
    normals = np.ascontiguousarray(normals, np.float64)
    group = np.array(np.zeros(len(corners)) if group is None else group, np.int64)
    splits = [build(_centres(corners, normals))]
    root, some = np.zeros((2, group.max(initial=0) + 1), np.int64)
    nodes, places = len(splits[0][1]), len(corners)
    for number in np.unique(group[group > 0]).tolist():
        own = np.flatnonzero(group == number)
        order, first, last, right = build(_centres(corners[own], normals[own]))
        root[number], some[number] = nodes, own[0]
        right = np.where(right > 0, right + nodes, 0)
        splits.append((own[order], first + places, last + places, right))
        nodes, places = nodes + len(first), places + len(order)
    order, first, last, right = (np.concatenate(each) for each in zip(*splits, strict=True))
    box = boxes(corners, normals, order, first, last, right)
    return Tree(corners, normals, order, first, last, right, box, group, root, some)


def _centres(corners: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(T, 6) twice the centres and normals; normals count less for the division of triangles."""
    middle = corners.min(axis=1) + corners.max(axis=1)
    return np.hstack([middle, 0.1 * np.ptp(middle, axis=0).max(initial=0) * (2 * normals)])


def moved(tree: Tree, corners: np.ndarray, normals: np.ndarray) -> Tree:
    """Update the boxes of a tree after its triangles have moved.

    The search stays exact; it is fast if the triangles have not moved far.
    """
    corners, normals = np.ascontiguousarray(corners), np.ascontiguousarray(normals)
    return tree._replace(corners=corners, normals=normals, box=boxes(corners, normals, *tree[2:6]))


def closest(
    tree: Tree,
    points: np.ndarray,
    normals: np.ndarray | None = None,
    alpha: float = 0.0,
    guess: np.ndarray | None = None,
    free: float = 0.0,
    group: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Closest points (N, 3), their triangles (N,) and barycentric weights (N, 3).

    guess : (N,) triangles at which the search starts. They change the time, not the result.
        Default: the triangle found for the preceding point
    free : squared difference of normals without penalty; with it, a point on a triangle with a
        compatible normal is its own closest point, also near a bend
    group : (N,) group of each point, among whose triangles it is searched; 0, or a group without
        triangles: all
    """
    points = np.ascontiguousarray(points, np.float64)
    normals = np.zeros_like(points) if normals is None else np.ascontiguousarray(normals)
    root = np.zeros(len(points), np.int64)
    if group is not None:
        root, some = tree.root[group], tree.some[group]
        guess = some if guess is None else guess
        guess = np.where((tree.group[guess] == group) | (root == 0), guess, some)
    guess = np.full(len(points), -1) if guess is None else guess
    found = side_by_side(
        [
            partial(
                search, tree, points[p], normals[p], float(alpha), guess[p], float(free), root[p]
            )
            for p in parts(len(points), LEAST)
        ]
    )
    face, weight = (np.concatenate(part) for part in zip(*found, strict=True))
    return np.einsum("nk,nkd->nd", weight, tree.corners[face]), face, weight


def distance(tree: Tree, points: np.ndarray) -> np.ndarray:
    """(N,) exact distances of points (N, 3) from the triangles."""
    return np.linalg.norm(points - closest(tree, points)[0], axis=1)
