"""Cheapest paths along the boundary edges of a hex mesh, close to a crease.

The cost of an edge depends on its distance from the crease, on the angle to it, and on the angles
that the hexes around it would have.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse import csr_array

from polycube.fitting.problem import FitProblem
from polycube.surface.curves.creases import Crease
from polycube.surface.measures import shortest_path, unit

REACH = 2.0  # largest distance of a vertex, in local sizes
# costs per length: any edge, squared distance, 1 - cos, deviation of the angle of a hex from 90
# degrees
LONG, AWAY, ASKEW, CROWDED = 0.1, 4.0, 2.0, 1.0
PRESENT, ALONG = 0.01, 0.2  # cost of an edge on the crease, and its largest 1 - cos
ANCHORS = 4  # number of anchor points of a loop


class Net(NamedTuple):
    """Boundary edges as a graph in both directions, sorted by their starts."""

    first: np.ndarray  # (V + 1,) the edges from vertex v begin at first[v]
    start: np.ndarray  # (A,) vertices
    end: np.ndarray  # (A,)
    run: np.ndarray  # (A, 3) unit directions
    length: np.ndarray  # (A,)
    hexes: np.ndarray  # (A,) number of hexes at each edge
    size: np.ndarray  # (V,) local edge length


def net(problem: FitProblem, x: np.ndarray) -> Net:
    """The boundary edges of a problem at positions x."""
    step = x[problem.sides[:, 1]] - x[problem.sides[:, 0]]
    length, run = np.linalg.norm(step, axis=1), unit(step)
    both = np.concatenate([problem.sides, problem.sides[:, ::-1]])
    order = np.argsort(both[:, 0], kind="stable")
    start, end = both[order].T
    return Net(
        np.searchsorted(start, np.arange(len(x) + 1)),
        start,
        end,
        np.concatenate([run, -run])[order],
        np.tile(length, 2)[order],
        np.tile(problem.side_valence, 2)[order],
        problem.size(x),
    )


def spans(first: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers first[a] to first[a + 1] - 1 for each a of `at` (N,); which of them, and each."""
    count = first[at + 1] - first[at]
    which = np.repeat(np.arange(len(at)), count)
    return which, np.arange(len(which)) + (first[at] - count.cumsum() + count)[which]


def crowding(inside: np.ndarray, hexes: np.ndarray) -> np.ndarray:
    """Deviation of the angle of each hex at an edge from 90 degrees, in units of 90 degrees."""
    return np.abs(inside / np.maximum(hexes, 1) / (np.pi / 2) - 1)


class Field(NamedTuple):
    """Cost of the edges close to a crease, with its own numbering of vertices."""

    vertex: np.ndarray  # (N,) ascending
    first: np.ndarray  # (N + 1,) index of the first edge from each vertex
    end: np.ndarray  # (A,)
    cost: np.ndarray  # (A,)


def field(crease: Crease, problem: FitProblem, x: np.ndarray, mesh: Net, on: float = 0.0) -> Field:
    """Edges between the vertices close to a crease; edges against its direction cost most.

    on : distance, in local sizes, up to which edges are on the crease already and cost least
    """
    low, high = crease.points.min(axis=0), crease.points.max(axis=0)
    place, reach = x[problem.outer], REACH * mesh.size[problem.outer, None]
    in_box = ((place > low - reach) & (place < high + reach)).all(axis=1)
    vertex = problem.outer[in_box]
    _, gap = crease.nearest(place[in_box])
    near = gap < reach[in_box, 0]
    vertex, gap = vertex[near], gap[near]
    one, leaving = spans(mesh.first, vertex)
    two = np.searchsorted(vertex, mesh.end[leaving])
    stays = np.append(vertex, -1)[two] == mesh.end[leaving]
    one, two, used = one[stays], two[stays], leaving[stays]
    start, end = mesh.start[used], mesh.end[used]
    arc, off = crease.nearest((x[start] + x[end]) / 2)
    _, direction, inside = crease.at(arc)
    size = (mesh.size[start] + mesh.size[end]) / 2
    square = (gap[one] ** 2 + gap[two] ** 2 + off**2) / 3
    askew = 1 - np.einsum("nd,nd->n", direction, mesh.run[used])
    each = LONG + AWAY * square / size**2 + ASKEW * askew
    each += CROWDED * crowding(inside, mesh.hexes[used])
    each[(np.maximum(gap[one], gap[two]) < on * size) & (askew < ALONG)] = PRESENT
    first = np.searchsorted(one, np.arange(len(vertex) + 1))
    return Field(vertex, first, two, each * mesh.length[used])


def cheapest(
    crease: Crease, field: Field, x: np.ndarray, placed: np.ndarray, taken: np.ndarray
) -> tuple[np.ndarray, float]:
    """Vertices of the cheapest free path, and its cost; infinite if there is none."""
    if not crease.is_loop:
        start, end = placed[list(crease.ends)]
        return _between(field, start, end, taken)
    best = np.zeros(0, np.int64), np.inf
    free = field.vertex[~taken[field.vertex]]
    if len(free) < ANCHORS:
        return best
    shares = np.arange(ANCHORS) / ANCHORS
    places, _, _ = crease.at(crease.length * shares)
    gap = np.linalg.norm(x[free][None] - places[:, None], axis=2)
    anchors = free[linear_sum_assignment(gap**2)[1]]
    for _ in range(3):
        path, cost = _cycle(field, anchors, taken)
        if not cost < best[1]:
            break
        best = path, cost
        anchors = path[((shares + 0.5 / ANCHORS) * len(path)).astype(int)]
    return best


def _cycle(field: Field, anchors: np.ndarray, taken: np.ndarray) -> tuple[np.ndarray, float]:
    """Cheapest paths from each anchor to the next, in sequence, and their cost."""
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
    """Cheapest path between two vertices over free vertices."""
    ends = np.searchsorted(field.vertex, [start, end])
    if start == end or (np.append(field.vertex, -1)[ends] != [start, end]).any():
        return np.zeros(0, np.int64), np.inf
    first, last = ends.tolist()
    is_free = ~taken[field.vertex]
    is_free[ends] = True
    one = np.repeat(np.arange(len(is_free)), np.diff(field.first))
    used = is_free[one] & is_free[field.end]
    links = one[used], field.end[used]
    graph = csr_array((field.cost[used], links), (len(is_free), len(is_free)))
    path, cost = shortest_path(graph, first, last)
    return field.vertex[path], cost
