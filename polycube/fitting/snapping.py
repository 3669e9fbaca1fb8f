"""Meshes with their boundary projected onto the surface, and the springs that pull it there."""

from dataclasses import dataclass

import numpy as np

from polycube.fitting.creases.constraints import Goals, Matching, goals
from polycube.fitting.local_polish import ALPHA
from polycube.fitting.merit import INVALID
from polycube.fitting.problem import FitProblem
from polycube.fitting.springs import Springs

OFF = 20.0  # scaled Jacobian equivalent to a diagonal of distance from the surface
COVER = 0.3  # weight of the springs of the surface in local rounds (0 loses the rim of the barrel)
STRAYED = 200.0  # the same for exact features, beyond the permitted distance
GOOD = 0.6  # scaled Jacobian above which the springs of the surface have weight 1


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
    return goals(problem, x, matching, ALPHA, trust > 0.3)


def state_of(problem: FitProblem, x: np.ndarray, at: Goals, trust: np.ndarray) -> State:
    """The state of the given positions."""
    return _measured(problem, x, at, at.place(problem, x), trust)


def _measured(
    problem: FitProblem, x: np.ndarray, at: Goals, goal: np.ndarray, trust: np.ndarray
) -> State:
    gap = np.linalg.norm(goal - x, axis=1)
    on_feature = np.append(at.curve, at.corner)
    strayed = 0.0
    if at.allowed is not None:
        strayed = float((gap - at.allowed)[on_feature].max(initial=0.0))
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
    allowed = np.minimum(least, problem.scaled_jacobian(x) - 1e-3)
    share = np.ones((len(x), 1))
    for attempt in range(100):
        y = x + share * (goal - x)
        vertex = np.unique(problem.hexes[problem.scaled_jacobian(y) < allowed])
        if not share[vertex].any():
            break
        share[vertex] *= 0.5 if attempt < 6 else 0.0
    return _measured(problem, y, at, goal, trust)


def cover_of(problem: FitProblem, state: State, strength: float) -> tuple[Springs, float]:
    """Springs of the surface on the quads, and the distance that 1 % of its points exceed."""
    weight = np.full(len(state.x), strength * (COVER if state.jacobian < GOOD else 1.0))
    springs = problem.cover(state.x, problem.normals(state.x)[1], 0.03, weight, 0.0)
    return springs, float(np.percentile(np.linalg.norm(springs.gaps(state.x), axis=1), 99))
