"""A path of boundary mesh edges for every crease of the surface.

Corners first: each gets one vertex, all together at the least total cost.  Then every crease gets
the cheapest path between the vertices of its corners, and a loop the cheapest cycle; a vertex is
on one path only, except at corners.  An edge costs what it is away from the crease, askew to it,
and what the solid's angle there would do to the hexes round it.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import dijkstra

from polycube.geometry.body import Body
from polycube.geometry.creases import Crease, Features
from polycube.geometry.hexes import edge_valence

logger = logging.getLogger(__name__)

REACH = 2.0  # farthest vertex of a path or corner, in local sizes
MEAN_REACH = 1.0  # farthest mean of a path
AWAY, ASKEW, CROWDED = 4.0, 2.0, 1.0  # costs: square distance, 1 - cos, angle of a hex off 90
NOT_MATCHED = 5.0  # cost of a corner without a vertex
ALONG = 0.6  # least mean cosine between path and crease
GAP = 2.0  # longest piece of a crease that one edge may skip, in its lengths
ANCHORS = 4  # of a loop


class Net(NamedTuple):
    """Boundary edges as a graph, both ways."""

    start: np.ndarray  # (A,) vertices
    end: np.ndarray  # (A,)
    run: np.ndarray  # (A, 3) unit directions
    length: np.ndarray  # (A,)
    hexes: np.ndarray  # (A,) number of hexes at each
    size: np.ndarray  # (V,) local edge length


@dataclass(frozen=True, eq=False)
class Route:
    """The vertices of the mesh that belong on one crease, in its order."""

    crease: Crease
    vertices: np.ndarray  # (N,); those of a loop once

    @property
    def sides(self) -> np.ndarray:
        """(E, 2) mesh edges of the path."""
        onward = np.roll(self.vertices, -1)
        sides = np.stack([self.vertices, onward], axis=1)
        return sides if self.crease.is_loop else sides[:-1]


def net(body: Body, x: np.ndarray) -> Net:
    """The boundary edges of a body at positions x."""
    hexes = boundary_valence(body)
    step = x[body.sides[:, 1]] - x[body.sides[:, 0]]
    length = np.maximum(np.linalg.norm(step, axis=1), 1e-30)
    run = step / length[:, None]
    both = np.concatenate([body.sides, body.sides[:, ::-1]])
    return Net(
        both[:, 0],
        both[:, 1],
        np.concatenate([run, -run]),
        np.tile(length, 2),
        np.tile(hexes, 2),
        body.size(x),
    )


def boundary_valence(body: Body) -> np.ndarray:
    """(E,) number of hexes at each of the body's sides."""
    found, count = edge_valence(body.hexes)
    key = np.array([len(body.mesh.vertices), 1])
    return count[np.searchsorted(found @ key, body.sides @ key)]


def crowding(inside: np.ndarray, hexes: np.ndarray) -> np.ndarray:
    """How far the angle of each of the hexes at an edge would be from 90 degrees, in those."""
    return np.abs(inside / np.maximum(hexes, 1) / (np.pi / 2) - 1)


def place_corners(features: Features, body: Body, x: np.ndarray, mesh: Net) -> np.ndarray:
    """(C,) vertex for each corner of the surface, no vertex twice; -1 where none suits."""
    corners = features.corners
    gap = np.linalg.norm(x[body.outer][None] - corners[:, None], axis=2)  # (C, B)
    near = gap < REACH * mesh.size[body.outer]
    cost = np.full(gap.shape, 1e6)
    order = np.argsort(mesh.start, kind="stable")
    first = np.searchsorted(mesh.start[order], np.arange(len(x) + 1))
    ways = _ways(features)
    for c, b in np.argwhere(near):
        leaving = order[first[body.outer[b]] : first[body.outer[b] + 1]]
        cost[c, b] = (gap[c, b] / mesh.size[body.outer[b]]) ** 2
        if ways[c]:
            away = np.stack([way for way, _ in ways[c]]) @ mesh.run[leaving].T  # (K, leaving)
            inside = np.array([angle for _, angle in ways[c]])[:, None]
            crowded = crowding(inside, mesh.hexes[leaving][None])
            cost[c, b] += (ASKEW * (1 - away) + CROWDED * crowded).min(axis=1).mean()
    alone = np.full((len(corners), len(corners)), NOT_MATCHED)
    row, column = linear_sum_assignment(np.hstack([np.minimum(cost, 1e6), alone]))
    found = np.full(len(corners), -1)
    real = column < len(body.outer)
    found[row[real]] = body.outer[column[real]]
    return found


def _ways(features: Features) -> list[list[tuple[np.ndarray, float]]]:
    """Direction and inside angle of each crease that leaves a corner."""
    ways: list[list[tuple[np.ndarray, float]]] = [[] for _ in features.corners]
    for crease in features.creases:
        if crease.is_loop:
            continue
        for end, sign in zip(crease.ends, (1, -1), strict=True):
            arc = 0.0 if sign > 0 else crease.length
            step = min(0.02, crease.length)
            to, _, inside = crease.at(np.array([arc + sign * step]))
            way = to[0] - features.corners[end]
            ways[end].append((way / max(np.linalg.norm(way), 1e-30), float(inside[0])))
    return ways


def find_routes(
    features: Features, body: Body, x: np.ndarray
) -> tuple[list[Route], np.ndarray, np.ndarray]:
    """Paths of the creases that have a good one, those with the cheapest first.

    Also the corners (P,) at their ends and the vertices (P,) placed there.
    """
    mesh = net(body, x)
    placed = place_corners(features, body, x, mesh)
    taken = np.zeros(len(x), bool)
    taken[placed[placed >= 0]] = True
    creases = [c for c in features.creases if c.is_loop or (placed[list(c.ends)] >= 0).all()]
    fields = {id(c): _field(c, body, x, mesh) for c in creases}
    costs = [_path(c, fields[id(c)], x, placed, taken)[1] for c in creases]
    routes = []
    for k in np.argsort(costs, kind="stable"):
        crease = creases[k]
        path, cost = _path(crease, fields[id(crease)], x, placed, taken)
        if np.isfinite(cost) and _is_good(crease, path, x, mesh):
            routes.append(Route(crease, path))
            taken[path] = True
    ends = np.unique([end for r in routes for end in r.crease.ends if end >= 0]).astype(np.int64)
    lost = len(features.creases) - len(routes)
    if features.creases:
        logger.info("features: %d of %d creases on mesh edges", len(routes), lost + len(routes))
    return routes, ends, placed[ends]


class _Field(NamedTuple):
    """Cost of the edges near a crease, on its own numbering of vertices."""

    vertex: np.ndarray  # (N,)
    graph: csr_matrix  # (N, N)


def _field(crease: Crease, body: Body, x: np.ndarray, mesh: Net) -> _Field:
    low, high = crease.points.min(axis=0), crease.points.max(axis=0)
    reach = REACH * mesh.size[body.outer]
    box = ((x[body.outer] > low - reach[:, None]) & (x[body.outer] < high + reach[:, None])).all(1)
    vertex = body.outer[box]
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
    return _Field(vertex, coo_matrix((weight, (number[start], number[end])), shape=(n, n)).tocsr())


def _path(
    crease: Crease, field: _Field, x: np.ndarray, placed: np.ndarray, taken: np.ndarray
) -> tuple[np.ndarray, float]:
    """Vertices of the cheapest path that is free, and its cost; infinite without one."""
    if not crease.is_loop:
        return _between(field, *placed[list(crease.ends)], taken)
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
    crease: Crease, field: _Field, x: np.ndarray, taken: np.ndarray, arc: np.ndarray
) -> np.ndarray:
    """Free vertices nearest to places on a loop."""
    free = field.vertex[~taken[field.vertex]]
    if len(free) < len(arc):
        return np.zeros(0, np.int64)
    places, _, _ = crease.at(arc)
    gap = np.linalg.norm(x[free][None] - places[:, None], axis=2)
    return free[linear_sum_assignment(gap**2)[1]]


def _cycle(field: _Field, anchors: np.ndarray, taken: np.ndarray) -> tuple[np.ndarray, float]:
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


def _between(field: _Field, start: int, end: int, taken: np.ndarray) -> tuple[np.ndarray, float]:
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


def _is_good(crease: Crease, path: np.ndarray, x: np.ndarray, mesh: Net) -> bool:
    """Whether a path is near its crease, runs its way, and leaves no part of it out."""
    closed = np.append(path, path[:1]) if crease.is_loop else path
    step = np.diff(x[closed], axis=0)
    length = np.linalg.norm(step, axis=1)
    arc, gap = crease.nearest(x[closed], expected_arc(crease, x, closed))
    _, way, _ = crease.at((arc[1:] + arc[:-1]) / 2)
    along = np.einsum("nd,nd->n", step, way).sum() / length.sum()
    near = (gap / mesh.size[closed]).mean() < MEAN_REACH
    skip = np.abs(np.diff(arc)) < length + GAP * mesh.size[closed[1:]]
    return bool(near and along > ALONG and skip.all())


def expected_arc(crease: Crease, x: np.ndarray, closed: np.ndarray) -> np.ndarray:
    """(N,) arc lengths that the vertices of a path would have at an even stretch.

    closed : (N,) the first vertex again at the end of a loop, where the arc length has grown by
        the length of the crease
    """
    length = np.append(0, np.cumsum(np.linalg.norm(np.diff(x[closed], axis=0), axis=1)))
    share = length / max(length[-1], 1e-30)
    start = crease.nearest(x[closed[:1]])[0][0] if crease.is_loop else 0.0
    return start + share * crease.length
