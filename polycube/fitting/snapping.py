"""Meshes with their boundary projected onto the surface, their merit, and springs that do it."""

from dataclasses import dataclass

import numpy as np

from polycube.fitting.creases.constraints import Goals, Matching, goals
from polycube.fitting.problem import FitProblem
from polycube.fitting.springs import Springs
from polycube.hexmesh.inspection import Inspection
from polycube.surface.fit_target import ALPHA
from polycube.types import Goal

OFF = 20.0  # scaled Jacobian equivalent to a diagonal of distance from the surface
TRUSTED = 0.3  # trust above which a vertex has a feature as its goal
POINT_ALPHA = 0.03  # weight of the difference of unit normals for points of the surface
COVER = 0.3  # weight of the springs of the surface in local rounds (0 loses the rim of the barrel)
STRAYED = 200.0  # the same for exact features, beyond the permitted distance
GOOD = 0.6  # scaled Jacobian above which the springs of the surface have weight 1
FULL = Goal.smooth_jacobian  # the scaled Jacobian counts in full up to this value
BEYOND = 0.25  # weight of the scaled Jacobian above it
# of the diagonal: distance from mesh edges that 5 % of the creases may exceed
CREASES = Goal.features
INVALID = 1e6  # penalty of an inverted hex: any valid mesh is better
SNAP_LOSS = 1e-3  # of the scaled Jacobian of a poor hex by a move to the goals
NEAR = 0.001  # of the diagonal: distance of boundary vertices without penalty
VOLUME = 0.03  # difference of the volume ratio from 1 without penalty
APART = 0.045  # of the diagonal: limit of the distance of all sample points in both directions


@dataclass(frozen=True, eq=False)
class State:
    """A mesh with its boundary moved to the goals, as far as its hexes permit."""

    x: np.ndarray  # (V, 3)
    jacobian: float  # smallest
    residual: float  # largest distance of a boundary vertex from its goal
    trust: np.ndarray  # (V,) weight of features and coverage
    strayed: float = 0.0  # largest distance from exact features, minus the permitted distance

    @property
    def score(self) -> float:
        """Score of the mesh; larger is better."""
        off = OFF * self.residual + STRAYED * self.strayed
        return self.jacobian - off - INVALID * (self.jacobian <= 0)


def goals_of(problem: FitProblem, x: np.ndarray, matching: Matching, trust: np.ndarray) -> Goals:
    """Goals of all boundary vertices; features only at trusted vertices (V,)."""
    return goals(problem, x, matching, ALPHA, trust > TRUSTED)


def state_of(problem: FitProblem, x: np.ndarray, at: Goals, trust: np.ndarray) -> State:
    """The state of the given positions."""
    gap = np.linalg.norm(at.place(problem, x) - x, axis=1)
    strayed = 0.0
    if at.allowed is not None:
        strayed = float((gap - at.allowed)[np.append(at.curve, at.corner)].max(initial=0.0))
    jacobian = float(problem.scaled_jacobian(x).min())
    return State(x, jacobian, float(gap[problem.outer].max(initial=0.0)), trust, strayed)


def snap(
    problem: FitProblem,
    x: np.ndarray,
    at: Goals,
    least: float,
    trust: np.ndarray,
    moves: np.ndarray | None = None,
) -> State:
    """Move the boundary to its goals, less far at hexes that would fall below `least`.

    A hex already below it must not become worse.

    moves : (V,) vertices that may move; None: all
    """
    goal = at.place(problem, x)
    if moves is not None:
        goal[~moves] = x[~moves]
    allowed = np.minimum(least, problem.scaled_jacobian(x) - SNAP_LOSS)
    share = np.ones((len(x), 1))
    for attempt in range(100):
        y = x + share * (goal - x)
        vertex = np.unique(problem.hexes[problem.scaled_jacobian(y) < allowed])
        if not share[vertex].any():
            break
        share[vertex] *= 0.5 if attempt < 6 else 0.0
    return state_of(problem, y, at, trust)


def cover_of(problem: FitProblem, state: State, strength: float) -> tuple[Springs, float]:
    """Springs of the surface on the quads, and the distance that 1 % of its points exceed."""
    weight = np.full(len(state.x), strength * (COVER if state.jacobian < GOOD else 1.0))
    springs = problem.cover(state.x, problem.normals(state.x)[1], POINT_ALPHA, weight, 0.0)
    return springs, float(np.percentile(np.linalg.norm(springs.gaps(state.x), axis=1), 99))


def merit_of(jacobian: float, vertices: float, creases: float, near: float = CREASES) -> float:
    """Merit of a worst hex, and of boundary vertices and creases; larger is better.

    jacobian : smallest scaled Jacobian
    vertices, creases : distances in diagonals
    near : distance of the creases without penalty
    """
    return (
        min(jacobian, FULL)
        + BEYOND * max(0, jacobian - FULL)
        - INVALID * (jacobian <= 0)
        - 20 * max(0, vertices - NEAR)
        - 5 * max(0, creases - near)
    )


def merit(found: Inspection) -> float:
    """Merit of a mesh; larger is better.

    There is no penalty for distances of up to 0.1 % of the diagonal for the vertices, 1 % for 99 %
    of the points, 0.3 % for 95 % of the creases, and 3 % for the volume.
    """
    apart = found.deviation
    return (
        merit_of(found.scaled_jacobian, apart.vertices, found.creases)
        - 5 * max(0, apart.p99 - Goal.distance)
        - 4 * max(0, abs(found.volume_ratio - 1) - VOLUME)
    )


def exceeded_limits(found: Inspection) -> int:
    """Number of limits that a mesh exceeds; it does not fit the surface if it exceeds one."""
    return sum(
        [
            found.scaled_jacobian < Goal.poor_jacobian,
            found.deviation.vertices >= Goal.far_vertices,
            found.largest >= APART,
            abs(found.volume_ratio - 1) >= Goal.far_volume,
        ]
    )
