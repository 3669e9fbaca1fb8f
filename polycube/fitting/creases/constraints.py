"""Vertices that belong to the creases of the surface, and their goals.

`paths` selects the vertices. They slide along their own crease in the order of the path, with a
distance of at least a fifth of the even spacing, so that edges cannot fold; corners are fixed.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from polycube.fitting.creases.paths import Route, find_routes
from polycube.fitting.problem import FitProblem
from polycube.fitting.springs import Springs, pull
from polycube.surface import arc_length as sliding
from polycube.surface.curves.features import Crease, covered
from polycube.surface.fit_target import ALPHA, FREE
from polycube.surface.measures import curved_faces

# weight of the difference of unit normals, a length in diagonals, for vertices close by
NEAR = 0.04
ALLOWED = 0.0025  # permitted distance from exact features at straight curves, in diagonals
NEAREST = 0.0005  # smallest permitted distance, at curved ones
STRAIGHT = 1 - 1e-5  # smallest ratio of the chord of a straight crease to its length
MOST = 0.5  # smallest share of the area of a part on its CAD face


@dataclass(frozen=True, eq=False)
class Matching:
    """Vertices that belong to creases and corners of the surface."""

    routes: tuple[Route, ...]
    corner: np.ndarray  # (P,) vertices
    corner_goal: np.ndarray  # (P, 3)
    allowed: np.ndarray | None = None  # (V,) permitted distance from them; None: any

    @property
    def sides(self) -> np.ndarray:
        """(N, 2) mesh edges on creases, with ascending ends."""
        none = np.zeros((0, 2), np.int64)
        return np.sort(np.concatenate([none, *(r.sides for r in self.routes)]), axis=1)

    @property
    def curve(self) -> np.ndarray:
        """(C,) vertices on creases, without the corners."""
        none = np.zeros(0, np.int64)
        return np.setdiff1d(np.concatenate([none, *(r.vertices for r in self.routes)]), self.corner)

    @cached_property
    def rails(self) -> tuple[np.ndarray, ...]:
        """Creases, vertices and their starts, as arguments of `slide`."""
        creases = [route.crease for route in self.routes]
        paths = [route.vertices for route in self.routes]
        points, arc = (np.concatenate([getattr(c, k) for c in creases]) for k in ("points", "arc"))
        first, start = (
            np.cumsum([0, *map(len, each)]) for each in ([c.arc for c in creases], paths)
        )
        is_loop = np.array([crease.is_loop for crease in creases])
        return points, arc, first, is_loop, np.concatenate(paths), start


@dataclass(frozen=True, eq=False)
class Goals:
    """Current goals of the boundary vertices."""

    foot: np.ndarray  # (B, 3) points on the surface for `problem.outer`
    facing: np.ndarray  # (B, 3) normals there
    curve: np.ndarray  # (C,) vertices on creases
    curve_foot: np.ndarray  # (C, 3)
    direction: np.ndarray  # (C, 3) of the crease
    corner: np.ndarray  # (P,) vertices at corners
    corner_goal: np.ndarray  # (P, 3)
    allowed: np.ndarray | None = None  # (V,) as in the matching

    def place(self, problem: FitProblem, x: np.ndarray) -> np.ndarray:
        """Positions (V, 3) with all boundary vertices at their goals."""
        goal = x.copy()
        goal[problem.outer] = self.foot
        goal[self.curve] = self.curve_foot
        goal[self.corner] = self.corner_goal
        return goal

    def springs(self, weight: np.ndarray) -> list[Springs]:
        """Springs to the creases, free along them, and to the corners; weight (V,)."""
        w, c = weight[self.curve], weight[self.corner]
        return [
            pull(self.curve, self.curve_foot, self.direction, -w, w),
            pull(self.corner, self.corner_goal, np.zeros((len(c), 3)), np.zeros(len(c)), c),
        ]


def match(problem: FitProblem, x: np.ndarray) -> Matching:
    """Paths for the creases of the surface on a mesh close to it, and vertices for the corners.

    The problem then assigns the quads to the CAD faces that the paths enclose. The tip of a cone
    gets the closest vertex inside its face.
    """
    features = problem.target.followed
    if not features.creases:
        return no_features()
    routes, ends, vertices = find_routes(features, problem, x)
    fixed = features.is_fixed[ends]
    found = Matching(tuple(routes), vertices[fixed], features.corners[ends[fixed]])
    faces = quad_faces(problem, x, on_crease(problem, found), [route.crease for route in routes])
    problem.restrict_to_faces(faces)
    corner, goal = [*found.corner], [*found.corner_goal]
    for tip, face in features.tips.items():
        inside = np.setdiff1d(problem.quads[faces == face], problem.quads[faces != face])
        if len(inside):
            away = np.linalg.norm(x[inside] - features.corners[tip], axis=1)
            corner.append(inside[away.argmin()])
            goal.append(features.corners[tip])
    return replace(found, corner=np.array(corner, int), corner_goal=np.reshape(goal, (-1, 3)))


def on_crease(problem: FitProblem, matching: Matching) -> np.ndarray:
    """(E,) whether each boundary edge is on the path of a crease."""
    key = np.array([len(problem.mesh.vertices), 1])
    return np.isin(problem.sides @ key, matching.sides @ key)


def on_curved(problem: FitProblem, matching: Matching) -> np.ndarray:
    """(V,) whether a vertex is on a curved crease or on a curved CAD face.

    There, the distance of edges and quads depends on even spacing.
    """
    surface = problem.target.surface
    found = np.zeros(len(problem.mesh.vertices), bool)
    if len(surface.region):
        found[problem.outer] = curved_faces(surface)[problem.vertex_face]
    for route in matching.routes:
        points = route.crease.points
        if np.linalg.norm(points[-1] - points[0]) < STRAIGHT * route.crease.length:
            found[route.vertices] = True
    return found


def with_tolerances(matching: Matching, n_vertices: int) -> Matching:
    """The same matching with permitted distances of the vertices (V,) from the features.

    The distance is reduced by the chord error of edges between vertices on a curve, and by the
    distance from other curves that share the path.
    """
    allowed = np.full(n_vertices, ALLOWED)
    for route in matching.routes:
        left = max(ALLOWED - route.sagitta - route.crease.off, NEAREST)
        allowed[route.vertices] = np.minimum(allowed[route.vertices], left)
    return replace(matching, allowed=allowed)


def no_features() -> Matching:
    """An empty matching."""
    return Matching((), np.zeros(0, np.int64), np.zeros((0, 3)))


def goals(
    problem: FitProblem, x: np.ndarray, matching: Matching, alpha: float, used: np.ndarray
) -> Goals:
    """Goals of all boundary vertices; features are used only at vertices `used` (V,)."""
    foot, facing = problem.feet(x, problem.normals(x)[0], alpha, FREE)
    curve, curve_foot, direction = _curve_feet(x, matching)
    free = used[curve] & ~np.isin(curve, matching.corner)
    here = used[matching.corner]
    corner, goal = matching.corner[here], matching.corner_goal[here]
    found = curve[free], curve_foot[free], direction[free]
    return Goals(foot, facing, *found, corner, goal, matching.allowed)


def on_goals(problem: FitProblem, x: np.ndarray, matching: Matching) -> np.ndarray:
    """(V, 3) positions with the boundary on the surface and matched vertices on their curves."""
    return goals(problem, x, matching, NEAR, np.ones(len(x), bool)).place(problem, x)


def along_curves(x: np.ndarray, matching: Matching, weight: np.ndarray) -> list[Springs]:
    """Springs from all matched vertices to their curves, free along them, and to the corners.

    weight : (V,)
    """
    curve, foot, direction = _curve_feet(x, matching)
    free = ~np.isin(curve, matching.corner)
    none = np.zeros((0, 3))
    corner, goal = matching.corner, matching.corner_goal
    return Goals(none, none, curve[free], foot[free], direction[free], corner, goal).springs(weight)


def _curve_feet(x: np.ndarray, matching: Matching) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices (C,) of all routes, their positions (C, 3) and the tangent directions (C, 3)."""
    if not matching.routes:
        return np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3))
    points, arc, first, is_loop, vertex, start = matching.rails
    return vertex, *sliding.slide(points, arc, first, is_loop, x[vertex], start)


def quad_faces(
    problem: FitProblem, x: np.ndarray, on_curve: np.ndarray, matched: Iterable[Crease]
) -> np.ndarray:
    """Find the CAD faces of the boundary quads.

    Returns (Q,) number of the CAD face; 0 if it is unknown.

    problem : the hex mesh and its surface
    x : (V, 3) positions close to the surface, at unit scale
    on_curve : (E,) whether each boundary edge is on the path of a curve
    matched : the curves that have a path
    """
    features, region = problem.target.followed, problem.target.surface.region
    if not features.n_faces:
        return np.zeros(len(problem.quads), np.int64)
    part, corners = problem.parts(~on_curve), x[problem.quads]
    _, triangle = problem.target.closest(corners.mean(axis=1), problem.normals(x)[1], ALPHA)
    cross = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    votes = np.zeros((part.max() + 1, region.max() + 1))
    np.add.at(votes, (part, region[triangle]), np.linalg.norm(cross, axis=1))
    face = votes.argmax(axis=1)
    share = votes.max(axis=1) / np.maximum(votes.sum(axis=1), 1e-300)
    found = {id(crease) for crease in matched}
    is_open = np.zeros(region.max() + 1, bool)
    for crease, is_double in zip(features.creases, covered(features), strict=True):
        if id(crease) not in found and not is_double:
            is_open[list(crease.faces)] = True
    return np.where(is_open[face] | (share <= MOST), 0, face)[part]
