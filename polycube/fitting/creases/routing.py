"""Cheapest paths along the boundary edges of a hex mesh, near a crease.

An edge costs what it is away from the crease, askew to it, and what the solid's angle there would
do to the hexes round it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import dijkstra

from polycube.fitting.problem import FitProblem
from polycube.hexmesh.connectivity import edge_valence
from polycube.surface.curves.creases import Crease

REACH = 2.0  # farthest vertex, in local sizes
AWAY, ASKEW, CROWDED = 4.0, 2.0, 1.0  # costs: square distance, 1 - cos, angle of a hex off 90
ANCHORS = 4  # of a loop


class Net(NamedTuple):
    """Boundary edges as a graph, both ways."""

    start: np.ndarray  # (A,) vertices
    end: np.ndarray  # (A,)
    run: np.ndarray  # (A, 3) unit directions
    length: np.ndarray  # (A,)
    hexes: np.ndarray  # (A,) number of hexes at each
    size: np.ndarray  # (V,) local edge length


def net(problem: FitProblem, x: np.ndarray) -> Net:
    """The boundary edges of a problem at positions x."""
    hexes = boundary_valence(problem)
    step = x[problem.sides[:, 1]] - x[problem.sides[:, 0]]
    length = np.maximum(np.linalg.norm(step, axis=1), 1e-30)
    run = step / length[:, None]
    both = np.concatenate([problem.sides, problem.sides[:, ::-1]])
    return Net(
        both[:, 0],
        both[:, 1],
        np.concatenate([run, -run]),
        np.tile(length, 2),
        np.tile(hexes, 2),
        problem.size(x),
    )


def boundary_valence(problem: FitProblem) -> np.ndarray:
    """(E,) number of hexes at each of the problem's sides."""
    found, count = edge_valence(problem.hexes)
    key = np.array([len(problem.mesh.vertices), 1])
    return count[np.searchsorted(found @ key, problem.sides @ key)]


def crowding(inside: np.ndarray, hexes: np.ndarray) -> np.ndarray:
    """How far the angle of each of the hexes at an edge would be from 90 degrees, in those."""
    return np.abs(inside / np.maximum(hexes, 1) / (np.pi / 2) - 1)


class Field(NamedTuple):
    """Cost of the edges near a crease, on its own numbering of vertices."""

    vertex: np.ndarray  # (N,)
    graph: csr_matrix  # (N, N)


def field(crease: Crease, problem: FitProblem, x: np.ndarray, mesh: Net) -> Field:
    """Edges between the vertices within reach of a crease; walking back along it costs most."""
    low, high = crease.points.min(axis=0), crease.points.max(axis=0)
    reach = REACH * mesh.size[problem.outer]
    box = (
        (x[problem.outer] > low - reach[:, None]) & (x[problem.outer] < high + reach[:, None])
    ).all(1)
    vertex = problem.outer[box]
    _, gap = crease.nearest(x[vertex])
    vertex, gap = vertex[gap < reach[box]], gap[gap < reach[box]]
    number = np.full(len(x), -1)
    number[vertex] = np.arange(len(vertex))
    used = (number[mesh.start] >= 0) & (number[mesh.end] >= 0)
    start, end = mesh.start[used], mesh.end[used]
    arc, off = crease.nearest((x[start] + x[end]) / 2)
    _, way, inside = crease.at(arc)
    size = (mesh.size[start] + mesh.size[end]) / 2
    square = (gap[number[start]] ** 2 + gap[number[end]] ** 2 + off**2) / 3
    askew = 1 - np.einsum("nd,nd->n", way, mesh.run[used])
    each = 0.1 + AWAY * square / size**2 + ASKEW * askew
    each += CROWDED * crowding(inside, mesh.hexes[used])
    n = len(vertex)
    weight = each * mesh.length[used]
    return Field(vertex, coo_matrix((weight, (number[start], number[end])), shape=(n, n)).tocsr())


def cheapest(
    crease: Crease, field: Field, x: np.ndarray, placed: np.ndarray, taken: np.ndarray
) -> tuple[np.ndarray, float]:
    """Vertices of the cheapest path that is free, and its cost; infinite without one."""
    if not crease.is_loop:
        start, end = placed[list(crease.ends)]
        return _between(field, start, end, taken)
    if len(field.vertex) == 0:
        return np.zeros(0, np.int64), np.inf
    shares = np.arange(ANCHORS) / ANCHORS
    best = np.zeros(0, np.int64), np.inf
    anchors = _anchors(crease, field, x, taken, crease.length * shares)
    for _ in range(3):
        path, cost = _cycle(field, anchors, taken)
        if not cost < best[1]:
            break
        best = path, cost
        n = len(path)
        anchors = path[((shares + 0.5 / ANCHORS) * n).astype(int)]
    return best


def _anchors(
    crease: Crease, field: Field, x: np.ndarray, taken: np.ndarray, arc: np.ndarray
) -> np.ndarray:
    """Free vertices nearest to places on a loop."""
    free = field.vertex[~taken[field.vertex]]
    if len(free) < len(arc):
        return np.zeros(0, np.int64)
    places, _, _ = crease.at(arc)
    gap = np.linalg.norm(x[free][None] - places[:, None], axis=2)
    return free[linear_sum_assignment(gap**2)[1]]


def _cycle(field: Field, anchors: np.ndarray, taken: np.ndarray) -> tuple[np.ndarray, float]:
    """Cheapest paths from each anchor to the next, one after the other, and their cost."""
    blocked, pieces, total = taken.copy(), [], 0.0
    blocked[anchors] = True
    if len(np.unique(anchors)) < 3:
        return anchors, np.inf
    for start, end in zip(anchors, np.roll(anchors, -1), strict=True):
        piece, cost = _between(field, start, end, blocked)
        if not np.isfinite(cost):
            return piece, np.inf
        pieces.append(piece[:-1])
        blocked[piece] = True
        total += cost
    return np.concatenate(pieces), total


def _between(field: Field, start: int, end: int, taken: np.ndarray) -> tuple[np.ndarray, float]:
    """Cheapest path between two vertices over vertices that are not taken."""
    nothing = np.zeros(0, np.int64), np.inf
    allowed = ~taken[field.vertex] | (field.vertex == start) | (field.vertex == end)
    index = np.flatnonzero(allowed)
    vertex = field.vertex[index]
    ends = [np.flatnonzero(vertex == v) for v in (start, end)]
    if start == end or any(len(e) == 0 for e in ends):
        return nothing
    first, last = (int(e[0]) for e in ends)
    graph = field.graph[index][:, index]
    cost, before = dijkstra(graph, indices=first, return_predecessors=True)
    if not np.isfinite(cost[last]):
        return nothing
    path = [last]
    while path[-1] != first:
        path.append(int(before[path[-1]]))
    return vertex[path[::-1]], float(cost[last])
