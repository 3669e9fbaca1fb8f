"""Sharp edges of the surface and the polycube edges that follow them.

A polycube edge is a chain of mesh edges between two patches.  It is sharp where the surface under
its two sides turns by more than 45 degrees and has a sharp edge near.  Vertices of sharp chains
belong on the nearest sharp edge that runs their way, ends of three chains on a corner.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from polycube.geometry import closest
from polycube.geometry.body import Body
from polycube.geometry.energy import Springs, pull
from polycube.geometry.hexes import unique_rows

NEAR = 0.8  # distance of a sharp edge from a sharp chain, in local sizes
REACH = 1.2  # of a vertex from its sharp edge
CORNER_REACH = 1.5  # of a vertex from its corner
ALONG = 0.7  # least cosine between a chain and its sharp edge
TURN = 0.05  # length that opposite directions are worth in the search, in diagonals


@dataclass(frozen=True, eq=False)
class Chains:
    """Mesh edges between patches, and the polycube edge each belongs to."""

    sides: np.ndarray  # (N, 2) vertices
    quads: np.ndarray  # (N, 2) on both sides
    number: np.ndarray  # (N,) polycube edge
    patches: np.ndarray  # (E, 2) of each polycube edge


@dataclass(frozen=True, eq=False)
class Matching:
    """Which vertices belong on sharp edges and corners of the surface."""

    sides: np.ndarray  # (N, 2) mesh edges of sharp chains
    curve: np.ndarray  # (C,) vertices
    corner: np.ndarray  # (P,) vertices
    corner_goal: np.ndarray  # (P, 3)


@dataclass(frozen=True, eq=False)
class Goals:
    """Where the boundary vertices should be now."""

    foot: np.ndarray  # (B, 3) on the surface, of `body.outer`
    facing: np.ndarray  # (B, 3) normals there
    curve: np.ndarray  # (C,) vertices with a sharp edge
    curve_foot: np.ndarray  # (C, 3)
    direction: np.ndarray  # (C, 3) of the sharp edge
    corner: np.ndarray  # (P,) vertices with a corner
    corner_goal: np.ndarray  # (P, 3)

    def place(self, body: Body, x: np.ndarray) -> np.ndarray:
        """Positions (V, 3) with all boundary vertices at their goals."""
        goal = x.copy()
        goal[body.outer] = self.foot
        goal[self.curve] = self.curve_foot
        goal[self.corner] = self.corner_goal
        return goal

    def springs(self, weight: np.ndarray) -> list[Springs]:
        """Pulls to the sharp edges, free along them, and to the corners; weight (V,)."""
        w, c = weight[self.curve], weight[self.corner]
        away = np.zeros((len(c), 3))
        return [
            pull(self.curve, self.curve_foot, self.direction, -w, w),
            pull(self.corner, self.corner_goal, away, np.zeros(len(c)), c),
        ]


def chains(body: Body) -> Chains:
    """Polycube edges of a mesh."""
    patches = np.sort(body.mesh.patch[body.side_quads], axis=1)
    between = patches[:, 0] != patches[:, 1]
    sides, quads, patches = body.sides[between], body.side_quads[between], patches[between]
    _, pair, _ = unique_rows(patches)
    # nodes (vertex, pair of patches): chains of one pair are connected through common vertices
    nodes, node = np.unique(sides + len(body.mesh.vertices) * pair[:, None], return_inverse=True)
    node = node.reshape(-1, 2)
    graph = coo_matrix((np.ones(len(node)), tuple(node.T)), shape=(len(nodes),) * 2)
    number = connected_components(graph, directed=False)[1][node[:, 0]]
    first = np.unique(number, return_index=True)[1]
    return Chains(sides, quads, number, patches[first])


def sharpness(body: Body, x: np.ndarray, edges: Chains) -> np.ndarray:
    """(E,) share of each polycube edge under which the surface is sharp."""
    if body.target.features.tree is None or len(edges.sides) == 0:
        return np.zeros(len(edges.patches))
    _, quad_normals = body.normals(x)
    _, face = body.target.closest(x[body.quads].mean(axis=1), quad_normals, 0.04)
    facing = body.target.normals[face][edges.quads]  # (N, 2, 3)
    turns = np.einsum("nd,nd->n", facing[:, 0], facing[:, 1]) < np.cos(np.pi / 4)
    middle = x[edges.sides].mean(axis=1)
    gap = closest.distance(body.target.features.tree, middle)
    sharp = turns & (gap < NEAR * body.size(x)[edges.sides].mean(axis=1))
    return np.bincount(edges.number, sharp) / np.bincount(edges.number)


def match(body: Body, x: np.ndarray, least: float = 0.5) -> Matching:
    """Sharp chains of a fitted mesh, and corners for their meeting points.

    least : share of a polycube edge that must be sharp
    """
    edges = chains(body)
    sides = edges.sides[(sharpness(body, x, edges) >= least)[edges.number]]
    degree = np.bincount(sides.ravel(), minlength=len(x))
    corner, goal = _corners(body, x, np.flatnonzero(degree >= 3))
    return Matching(sides, np.setdiff1d(np.flatnonzero(degree), corner), corner, goal)


def no_features() -> Matching:
    """A matching of nothing."""
    none = np.zeros(0, np.int64)
    return Matching(np.zeros((0, 2), np.int64), none, none, np.zeros((0, 3)))


def _corners(body: Body, x: np.ndarray, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices with a corner of the surface near, each corner used once, nearest pairs first."""
    corners = body.target.features.corners
    gap = np.linalg.norm(x[vertices][:, None] - corners, axis=2)  # (N, C)
    near = gap < CORNER_REACH * body.size(x)[vertices][:, None]
    found: dict[int, int] = {}
    for flat in np.argsort(gap, axis=None, kind="stable"):
        i, j = divmod(int(flat), max(len(corners), 1))
        if near[i, j] and i not in found and j not in found.values():
            found[i] = j
    return vertices[list(found)], corners[list(found.values())].reshape(-1, 3)


def goals(body: Body, x: np.ndarray, matching: Matching, alpha: float, used: np.ndarray) -> Goals:
    """Feet of all boundary vertices; features only where `used` (V,)."""
    normals, _ = body.normals(x)
    foot, facing = body.feet(x, normals, alpha)
    curve, curve_foot, direction = _curve_feet(body, x, matching, used)
    here = used[matching.corner]
    corner, goal = matching.corner[here], matching.corner_goal[here]
    return Goals(foot, facing, curve, curve_foot, direction, corner, goal)


def _curve_feet(
    body: Body, x: np.ndarray, matching: Matching, used: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices (C,), feet (C, 3) and directions (C, 3) on sharp edges that run along the chain."""
    vertex = matching.curve[used[matching.curve]]
    if len(vertex) == 0 or body.target.features.tree is None:
        return np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3))
    tree = body.target.features.tree
    run = _tangents(x, matching.sides)[vertex]
    foot, segment, _ = closest.closest(tree, x[vertex], run, TURN)
    direction = tree.normals[segment]
    gap = np.linalg.norm(x[vertex] - foot, axis=1)
    along = np.abs(np.einsum("nd,nd->n", direction, run)) > ALONG
    fits = along & (gap < REACH * body.size(x)[vertex])
    return vertex[fits], foot[fits], direction[fits]


def _tangents(x: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """(V, 3) direction of the mesh edges at each vertex: their first principal axis."""
    run = x[sides[:, 1]] - x[sides[:, 0]]
    run /= np.maximum(np.linalg.norm(run, axis=1, keepdims=True), 1e-30)
    spread = np.zeros((len(x), 3, 3))
    for end in range(2):
        np.add.at(spread, sides[:, end], run[:, :, None] * run[:, None, :])
    return np.linalg.eigh(spread)[1][:, :, 2]
