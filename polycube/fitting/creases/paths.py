"""A path of boundary mesh edges for every crease of the surface.

First each corner is assigned a vertex, with the smallest total cost. Then every crease gets the
cheapest path between the vertices of its corners, and a loop the cheapest cycle. A vertex belongs
to one path only, except at corners. `routing` defines the cost of an edge.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from polycube.fitting.creases.routing import (
    ASKEW,
    CROWDED,
    REACH,
    Net,
    cheapest,
    crowding,
    field,
    net,
    spans,
)
from polycube.fitting.problem import FitProblem
from polycube.surface import arc_length as sliding
from polycube.surface.curves.features import Crease, Features, covered, merged
from polycube.surface.measures import unit

logger = logging.getLogger(__name__)

FORBIDDEN = 1e6  # cost of a vertex out of reach of a corner
STEP = 0.02  # arc length, in diagonals, over which the direction of a crease at its end is taken
MEAN_REACH = 1.0  # largest mean distance of a path
NOT_MATCHED = 5.0  # cost of a corner without a vertex
ALONG = 0.6  # smallest mean cosine between path and crease
ATTEMPTS = 5  # number of attempts to find paths for all creases, each in a different order
GAP = 2.0  # longest part of a crease without an edge, in edge lengths


@dataclass(frozen=True, eq=False)
class Route:
    """The mesh vertices that belong to one crease, in its order."""

    crease: Crease
    vertices: np.ndarray  # (N,); those of a loop without repetition

    @property
    def sides(self) -> np.ndarray:
        """(E, 2) mesh edges of the path."""
        return path_sides(self.vertices, self.crease.is_loop)

    @property
    def sagitta(self) -> float:
        """Largest distance of the crease from chords of equal length, one for each edge."""
        places = self.crease.at(np.linspace(0, self.crease.length, len(self.sides) + 1))[0]
        if self.crease.is_loop:
            places[-1] = places[0]
        return float(self.crease.nearest((places[1:] + places[:-1]) / 2)[1].max())


def numbered(routes: Sequence[Route], features: Features) -> dict[int, np.ndarray]:
    """Vertices of each path by the number of its curve."""
    number = {id(crease): k for k, crease in enumerate(features.creases)}
    return {number[id(route.crease)]: route.vertices for route in routes}


def path_sides(path: np.ndarray, is_loop: bool) -> np.ndarray:
    """(N, 2) edges of a path of vertices."""
    sides = np.stack([path, np.roll(path, -1)], axis=1)
    return sides if is_loop else sides[:-1]


def place_corners(features: Features, problem: FitProblem, x: np.ndarray, mesh: Net) -> np.ndarray:
    """(C,) vertex for each corner of the surface; -1 for a tip, and if there is no suitable one.

    A vertex is only used once, except for coincident corners.
    """
    representative = merged(features)
    number = np.arange(len(representative))
    distinct = np.flatnonzero((representative == number) & ~np.isin(number, [*features.tips]))
    reach = REACH * mesh.size[problem.outer]
    around = cKDTree(x[problem.outer]).query_ball_point(
        features.corners[distinct], reach.max(), return_sorted=True
    )
    corner = np.repeat(np.arange(len(distinct)), [len(each) for each in around])
    candidate = np.concatenate([*around, []]).astype(np.int64)
    gap = np.linalg.norm(x[problem.outer[candidate]] - features.corners[distinct[corner]], axis=1)
    near = gap < reach[candidate]
    corner, candidate, gap = corner[near], candidate[near], gap[near]
    vertices, column = np.unique(problem.outer[candidate], return_inverse=True)
    cost = np.full((len(distinct), len(vertices) + len(distinct)), FORBIDDEN)
    cost[corner, column] = (gap / mesh.size[vertices[column]]) ** 2
    cost[corner, column] += _misfits(features, distinct[corner], vertices[column], mesh)
    cost[:, len(vertices) :] = NOT_MATCHED
    row, column = linear_sum_assignment(np.minimum(cost, FORBIDDEN))
    found = np.full(len(representative), -1)
    real = column < len(vertices)
    found[distinct[row[real]]] = vertices[column[real]]
    return found[representative]


def _leaving_directions(features: Features) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Directions (K, 3) and inside angles (K,) of the creases that leave corners.

    The third array gives the index at which the creases of corner c begin.
    """
    rows = []
    for crease in features.creases:
        if crease.is_loop:
            continue
        for end, sign in zip(crease.ends, (1, -1), strict=True):
            arc = 0.0 if sign > 0 else crease.length
            to, _, inside = crease.at(np.array([arc + sign * min(STEP, crease.length)]))
            rows.append([*unit(to[0] - features.corners[end]), inside[0], end])
    table = np.reshape(rows, (-1, 5))
    table = table[np.argsort(table[:, 4], kind="stable")]
    first = np.searchsorted(table[:, 4], np.arange(len(features.corners) + 1))
    return table[:, :3], table[:, 3], first


def _misfits(features: Features, corner: np.ndarray, vertex: np.ndarray, mesh: Net) -> np.ndarray:
    """(N,) mean cost of the creases that leave each corner (N,), on the edges of a vertex (N,)."""
    direction, inside, first = _leaving_directions(features)
    pair, crease = spans(first, corner)
    which, edge = spans(mesh.first, vertex[pair])
    own = crease[which]
    askew = 1 - (direction[own] * mesh.run[edge]).sum(axis=1)
    each = ASKEW * askew + CROWDED * crowding(inside[own], mesh.hexes[edge])
    least = np.minimum.reduceat(each, np.searchsorted(which, np.arange(len(pair))))
    return np.bincount(pair, least / np.bincount(pair)[pair], len(corner))


def find_routes(
    features: Features, problem: FitProblem, x: np.ndarray, on: float = 0.0
) -> tuple[list[Route], np.ndarray, np.ndarray]:
    """Paths of the creases, for those with a good path; paths share vertices only at corners.

    Paths that exist in the mesh are reused, and curves that coincide with others have none. The
    others are routed in the order of cost. If a path blocks another crease, that crease is routed
    first in a new attempt; the attempt with the most paths is used.

    on : distance, in local sizes, up to which edges are on a crease already and are preferred

    Returns the paths, the corners (P,) at their ends and the vertices (P,) assigned to them.
    """
    mesh = net(problem, x)
    placed, same = place_corners(features, problem, x, mesh), merged(features)
    existing = [Route(features.creases[int(k)], path) for k, path in problem.mesh.paths.items()]
    taken = np.zeros(len(x), bool)
    for route in existing:
        taken[route.vertices] = True
    placed[taken[placed]] = -1
    for route in existing:
        if not route.crease.is_loop:
            for end, vertex in zip(route.crease.ends, route.vertices[[0, -1]], strict=True):
                placed[same == same[end]] = vertex
    taken[placed[placed >= 0]] = True
    known = {id(route.crease) for route in existing}
    creases = [
        c
        for c, is_double in zip(features.creases, covered(features), strict=True)
        if not is_double and id(c) not in known and (c.is_loop or (placed[list(c.ends)] >= 0).all())
    ]
    fields = [field(c, problem, x, mesh, on) for c in creases]
    unblocked = [cheapest(c, own, x, placed, taken) for c, own in zip(creases, fields, strict=True)]
    possible = [k for k in range(len(creases)) if _is_good(creases[k], *unblocked[k], x, mesh)]
    order = sorted(possible, key=lambda k: unblocked[k][1])
    routes: list[Route] = []
    for _ in range(ATTEMPTS):
        found, blocked, used = [], [], taken.copy()
        for k in order:
            crease, own = creases[k], fields[k]
            path, is_good = unblocked[k][0], True
            needed = own.vertex if crease.is_loop else path[1:-1]
            if not np.array_equal(used[needed], taken[needed]):
                path, cost = cheapest(crease, own, x, placed, used)
                is_good = _is_good(crease, path, cost, x, mesh)
            if is_good:
                found.append(Route(crease, path))
                used[path] = True
            else:
                blocked.append(k)
        if len(found) > len(routes):
            routes = found
        if not blocked:
            break
        order = blocked + [k for k in order if k not in blocked]
    routes = existing + routes
    ends = np.unique([end for r in routes for end in r.crease.ends if end >= 0]).astype(np.int64)
    ends = ends[np.unique(placed[ends], return_index=True)[1]]
    if features.creases:
        wanted = len(features.creases) - int(covered(features).sum())
        logger.info("features: %d of %d creases on mesh edges", len(routes), wanted)
    return routes, ends, placed[ends]


def _is_good(crease: Crease, path: np.ndarray, cost: float, x: np.ndarray, mesh: Net) -> bool:
    """Whether there is a path close to its crease, in its direction and without gaps."""
    if not np.isfinite(cost):
        return False
    closed = np.append(path, path[:1]) if crease.is_loop else path
    step = np.diff(x[closed], axis=0)
    length = np.linalg.norm(step, axis=1)
    expected = sliding.expected(crease.points, crease.arc, crease.is_loop, x[closed])
    arc, gap = crease.nearest(x[closed], expected)
    _, direction, _ = crease.at((arc[1:] + arc[:-1]) / 2)
    along = np.einsum("nd,nd->n", step, direction).sum() / length.sum()
    near = (gap / mesh.size[closed]).mean() < MEAN_REACH
    skip = np.abs(np.diff(arc)) < length + GAP * mesh.size[closed[1:]]
    return bool(near and along > ALONG and skip.all())
