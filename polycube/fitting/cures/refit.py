"""Fit a neighbourhood with a sheet; its surroundings are fixed."""

from dataclasses import dataclass

import numpy as np

from polycube.fitting import energy
from polycube.fitting.cures.fitted import cost, distances
from polycube.fitting.cures.halved import certified_jacobian, halved_energy
from polycube.fitting.cures.neighbourhood import Neighbourhood
from polycube.fitting.energy import Terms
from polycube.fitting.local_polish import ON_GOAL, Region, pull_back, rails_of, retraction
from polycube.fitting.snapping import goals_of, snap
from polycube.fitting.springs import pull, together
from polycube.numerics.lbfgs import descend

WEIGHTS = (1.0, 10.0, 100.0)  # weights of the boundary while a sheet unfolds
BETAS = (20.0, 20.0, 30.0, 30.0, 40.0, 60.0)  # sharpness of the soft minimum in each round
# factor on the original cost, for each round, above which the fit is abandoned
ABANDON = (2.5, 2.0, 1.5, 1.3, 1.2, 1.1)
# scaled Jacobian below which the vertices of a hex are not moved to their goals
SNAPPED = (0.05, 0.1)
WORSE = 1.2  # factor on the cost for vertices moved to their goals


@dataclass(frozen=True, eq=False)
class Refit:
    """Positions (N', 3) of a neighbourhood, and their quality."""

    x: np.ndarray
    cost: float
    least: float  # smallest scaled Jacobian
    gap: np.ndarray  # (N',)
    strayed: np.ndarray  # (N',)


def refit(near: Neighbourhood, aim: float, before: float) -> Refit:
    """The best fit found.

    near : the neighbourhood
    aim : scaled Jacobian above which hexes have no cost
    before : cost of the original mesh; fits with a much larger cost are abandoned
    """
    problem = near.problem
    x = problem.mesh.vertices.copy()
    lengths = problem.lengths(x, 3, 0.1)
    for weight in WEIGHTS:
        x = _descended(near, x, lengths, Terms(), 40, weight)
        lengths = problem.lengths(x, 2, 0.05)
    soft = Terms(shape=0.2, barrel=0.1, jacobian=1.0, beta=5.0, offset=0.2)
    x = _descended(near, x, lengths, soft, 30, WEIGHTS[-1])
    lengths = problem.lengths(x, 2, 0.05)
    x = at_goals(near, x, SNAPPED[0])
    best = evaluated(near, x, aim)
    for beta, most in zip(BETAS, ABANDON, strict=True):
        x = _slid(near, x, lengths, beta)
        free, snapped = (evaluated(near, y, aim) for y in (x, at_goals(near, x, SNAPPED[1])))
        best = min(best, free, snapped, key=lambda each: each.cost)
        x = snapped.x if snapped.cost < WORSE * free.cost else x
        if best.cost == 0 or best.cost > most * before:
            break
    return best


def evaluated(near: Neighbourhood, x: np.ndarray, aim: float) -> Refit:
    """Positions (N', 3) of a neighbourhood with their cost."""
    gap, strayed = distances(near.problem, x, near.matching)
    gap[~near.moves] = strayed[~near.moves] = 0
    jacobian = certified_jacobian(x, near.problem.hexes)
    return Refit(x, *cost(jacobian, gap, strayed, aim), gap, strayed)


def at_goals(near: Neighbourhood, x: np.ndarray, least: float) -> np.ndarray:
    """Move the boundary to its goals, or less far if hexes would fall below `least`."""
    trust = np.ones(len(x))
    at = goals_of(near.problem, x, near.matching, trust)
    return snap(near.problem, x, at, least, trust, near.moves).x


def _descended(
    near: Neighbourhood,
    x: np.ndarray,
    lengths: np.ndarray,
    terms: Terms,
    iterations: int,
    weight: float,
) -> np.ndarray:
    """Positions of lower energy, with springs of a given weight at the boundary."""
    problem = near.problem
    at = goals_of(problem, x, near.matching, np.ones(len(x)))
    every = weight / problem.size(x) ** 2
    free = ~np.isin(problem.outer, np.append(at.curve, at.corner))
    vertex, on = problem.outer[free], every[problem.outer[free]]
    springs = [pull(vertex, at.foot[free], at.facing[free], on, 0.01 * on), *at.springs(every)]
    return problem.relax(x, lengths, terms, springs, iterations, near.moves)


def _slid(near: Neighbourhood, x: np.ndarray, lengths: np.ndarray, beta: float) -> np.ndarray:
    """Positions with a higher soft minimum of the scaled Jacobian; the boundary slides."""
    problem = near.problem
    all_indices = np.arange(len(problem.hexes)), np.arange(len(x))
    region = Region(*all_indices, problem.hexes, near.moves)
    at = goals_of(problem, x, near.matching, np.ones(len(x)))
    is_away = np.linalg.norm(at.place(problem, x) - x, axis=1) > ON_GOAL
    springs = together([pull_back(problem, x, at, region, is_away)])
    rails, slides = rails_of(problem, x, at, region, is_away)
    least = energy.least_determinant(x, problem.hexes, lengths)
    terms = Terms(0.01, 1e-3, 0.05, 1.0, beta, 0.2, min(0.5 * least, 1e-3))
    whole = halved_energy(x, problem.hexes, lengths, terms, springs)

    def function(y: np.ndarray) -> tuple[float, np.ndarray]:
        value, gradient = whole(y)
        return value, np.einsum("vij,vj->vi", rails, gradient)

    own = np.searchsorted(problem.outer, np.flatnonzero(slides))
    normals = problem.normals(x)[0][slides]
    back = retraction(problem, normals, slides, problem.vertex_face[own])
    return descend(function, x, 25, retract=back)
