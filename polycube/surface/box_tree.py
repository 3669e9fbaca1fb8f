"""Box tree of triangles and their normals, and the search for closest points: compiled functions.

`polycube.surface.closest` describes the objective of the search.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from polycube.numerics.vectors import Vector, dot, minus

LEAF = 4  # triangles in a leaf


class Tree(NamedTuple):
    """Box tree of T triangles, and a tree for each group of them.

    Nodes are in depth-first order; the left child follows its parent. Those of all triangles are
    first; `order` lists each grouped triangle twice.
    """

    corners: np.ndarray  # (T, 3, 3)
    normals: np.ndarray  # (T, 3)
    order: np.ndarray  # triangles, leaf by leaf
    first: np.ndarray  # (M,) start in `order`
    last: np.ndarray  # (M,) end in `order`
    right: np.ndarray  # (M,) right child; 0 at a leaf
    box: np.ndarray  # (M, 12) lowest positions and normals, then the highest
    group: np.ndarray  # (T,) group of each triangle; 0: none
    root: np.ndarray  # (G,) root node of the tree of each group; 0 for a group without triangles
    some: np.ndarray  # (G,) one triangle of each group


@njit(cache=True, nogil=True, error_model="numpy")
def build(centre: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """`order`, `first`, `last` and `right` of a `Tree`.

    centre : (T, 6) positions of the triangles, and their normals in the same unit
    """
    n = len(centre)
    order = np.arange(n)
    first, last, right = np.zeros((3, 2 * n), np.int64)
    begin, end, parent = np.zeros((3, 128), np.int64)
    end[0], parent[0] = n, -1
    top, count = 1, 0
    while top > 0:
        top -= 1
        s, e, node = begin[top], end[top], count
        count += 1
        first[node], last[node] = s, e
        if parent[top] >= 0:
            right[parent[top]] = node
        axis, widest = 0, -1.0
        for d in range(6):
            lo, hi = np.inf, -np.inf
            for i in order[s:e]:
                lo, hi = min(lo, centre[i, d]), max(hi, centre[i, d])
            if hi - lo > widest:
                axis, widest = d, hi - lo
        if e - s > LEAF:
            own = order[s:e].copy()
            for k, place in enumerate(np.argsort(centre[own, axis], kind="mergesort"), s):
                order[k] = own[place]
            middle = (s + e) // 2
            # right child: after all nodes of the left part
            begin[top], end[top], parent[top] = middle, e, node
            begin[top + 1], end[top + 1], parent[top + 1] = s, middle, -1
            top += 2
    return order, first[:count], last[:count], right[:count]


@njit(cache=True, nogil=True, error_model="numpy")
def boxes(
    corners: np.ndarray,
    normals: np.ndarray,
    order: np.ndarray,
    first: np.ndarray,
    last: np.ndarray,
    right: np.ndarray,
) -> np.ndarray:
    """`box` of a `Tree`: from the triangles of a leaf, or from both children, which come later."""
    box = np.empty((len(first), 12))
    box[:, :6], box[:, 6:] = np.inf, -np.inf
    for node in range(len(first) - 1, -1, -1):
        if right[node] > 0:
            for child in (node + 1, right[node]):
                for d in range(6):
                    box[node, d] = min(box[node, d], box[child, d])
                    box[node, 6 + d] = max(box[node, 6 + d], box[child, 6 + d])
            continue
        for i in order[first[node] : last[node]]:
            for d in range(3):
                for k in range(3):
                    box[node, d] = min(box[node, d], corners[i, k, d])
                    box[node, 6 + d] = max(box[node, 6 + d], corners[i, k, d])
                box[node, 3 + d] = min(box[node, 3 + d], normals[i, d])
                box[node, 9 + d] = max(box[node, 9 + d], normals[i, d])
    return box


@njit(cache=True, error_model="numpy", inline="always")
def _bound(box: np.ndarray, node: int, x: Vector, n: Vector, square: float, free: float) -> float:
    """Lower bound of the objective over the triangles of the node."""
    away, turned = 0.0, 0.0
    for d in range(3):
        gap = max(box[node, d] - x[d], x[d] - box[node, 6 + d], 0.0)
        turn = max(box[node, 3 + d] - n[d], n[d] - box[node, 9 + d], 0.0)
        away += gap * gap
        turned += turn * turn
    return away + square * max(turned - free, 0.0)


@njit(cache=True, error_model="numpy")
def _weights(x: Vector, a: Vector, b: Vector, c: Vector) -> tuple[float, float]:
    """Barycentric weights of b and c at the point of triangle (a, b, c) closest to x."""
    ab, ac = minus(b, a), minus(c, a)
    gap = minus(x, a)
    d1, d2 = dot(ab, gap), dot(ac, gap)
    if d1 <= 0 and d2 <= 0:
        return 0.0, 0.0
    gap = minus(x, b)
    d3, d4 = dot(ab, gap), dot(ac, gap)
    if d3 >= 0 and d4 <= d3:
        return 1.0, 0.0
    gap = minus(x, c)
    d5, d6 = dot(ab, gap), dot(ac, gap)
    if d6 >= 0 and d5 <= d6:
        return 0.0, 1.0
    vc = d1 * d4 - d3 * d2
    if vc <= 0 and d1 >= 0 and d3 <= 0:
        return d1 / (d1 - d3), 0.0
    vb = d5 * d2 - d1 * d6
    if vb <= 0 and d2 >= 0 and d6 <= 0:
        return 0.0, d2 / (d2 - d6)
    va = d3 * d6 - d5 * d4
    if va <= 0 and d4 >= d3 and d5 >= d6:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return 1.0 - w, w
    return vb / (va + vb + vc), vc / (va + vb + vc)


@njit(cache=True, error_model="numpy", inline="always")
def _row(array: np.ndarray, i: int) -> Vector:
    return (array[i, 0], array[i, 1], array[i, 2])


@njit(cache=True, error_model="numpy")
def _value(
    tree: Tree, face: int, x: Vector, n: Vector, square: float, free: float, most: float
) -> tuple[float, float, float]:
    """Squared distance, penalty of the normal, and the weights of the closest point.

    The result is infinite if the penalty alone is not below `most`.
    """
    turn = minus(n, _row(tree.normals, face))
    misfit = square * max(dot(turn, turn) - free, 0.0)
    if misfit >= most:
        return np.inf, 0.0, 0.0
    t = tree.corners[face]
    a, b, c = _row(t, 0), _row(t, 1), _row(t, 2)
    v, w = _weights(x, a, b, c)
    away = 0.0
    for d in range(3):
        gap = x[d] - (1 - v - w) * a[d] - v * b[d] - w * c[d]
        away += gap * gap
    return away + misfit, v, w


@njit(cache=True, nogil=True, error_model="numpy")
def search(
    tree: Tree,
    points: np.ndarray,
    normals: np.ndarray,
    alpha: float,
    guess: np.ndarray,
    free: float,
    root: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (N,) and weights (N, 3) of the closest points."""
    square = alpha * alpha
    face = np.zeros(len(points), np.int64)
    weight = np.zeros((len(points), 3))
    stack, bounds = np.zeros(128, np.int64), np.zeros(128)
    f = tree.order[0]
    for i in range(len(points)):
        x, n = _row(points, i), _row(normals, i)
        f = guess[i] if guess[i] >= 0 else f
        best, bv, bw = _value(tree, f, x, n, square, free, np.inf)
        stack[0], bounds[0], top = root[i], 0.0, 1
        while top > 0:
            top -= 1
            node = stack[top]
            if bounds[top] >= best:
                continue
            if tree.right[node] == 0:
                for j in tree.order[tree.first[node] : tree.last[node]]:
                    value, v, w = _value(tree, j, x, n, square, free, best)
                    if value < best:
                        best, bv, bw, f = value, v, w, j
                continue
            near, far = node + 1, tree.right[node]
            a = _bound(tree.box, near, x, n, square, free)
            b = _bound(tree.box, far, x, n, square, free)
            if b < a:
                near, far, a, b = far, near, b, a
            if b < best:
                stack[top], bounds[top] = far, b
                top += 1
            if a < best:
                stack[top], bounds[top] = near, a
                top += 1
        face[i] = f
        weight[i, 0], weight[i, 1], weight[i, 2] = 1 - bv - bw, bv, bw
    return face, weight
