"""Fit a neighbourhood, with fixed surroundings: with a sheet, or in an envelope of the surface.

With an exact boundary, a hex at an acute corner or between two close curves cannot be better than
the angle there. In an envelope of the surface, boundary vertices may leave their goals by a small
distance, as in Hu et al. 2020 (Fast tetrahedral meshing in the wild); vertices on curves and
corners by their permitted distance.
"""

from dataclasses import dataclass, replace
from functools import partial, reduce

import numpy as np

from polycube.fitting import energy
from polycube.fitting.creases.constraints import Goals
from polycube.fitting.cures.fitted import certified_jacobian, cost, distances, halved_energy
from polycube.fitting.cures.neighbourhood import Neighbourhood
from polycube.fitting.energy import Terms
from polycube.fitting.local_polish import SLIDING, Function, Region, slid
from polycube.fitting.problem import KEPT, RESHAPED
from polycube.fitting.snapping import goals_of, snap
from polycube.fitting.springs import pull
from polycube.numerics.lbfgs import descend
from polycube.types import Goal

WEIGHTS = (1.0, 10.0, 100.0)  # weights of the boundary while a sheet unfolds
SLACK = 0.01  # share of these weights along the surface
SETTLING = Terms(shape=0.2, barrel=0.1, jacobian=1.0, beta=5.0, offset=0.2)  # afterwards
UNFOLD_BETAS = (20.0, 20.0, 30.0, 30.0, 40.0, 60.0)  # sharpness of the soft minimum in each round
UNFOLD_OFFSET = 0.2  # scaled Jacobian at which a hex costs 1 / beta
# factor on the original cost, for each round, above which the fit is abandoned
ABANDON = (2.5, 2.0, 1.5, 1.3, 1.2, 1.1)
# scaled Jacobian below which the vertices of a hex are not moved to their goals
SNAPPED = (0.05, 0.1)
UNFOLD_WORSE = 1.2  # factor on the cost for vertices moved to their goals
IN_ENVELOPE = SLIDING._replace(shape=1e-3)  # energy in the envelope
BETAS = (30.0, 60.0, 120.0, 250.0)  # sharpness of the soft minimum, in sequence
ROUNDS = 4  # rounds for each; closest points are updated once per round
ITERATIONS = 5  # few, since the limits of vertices are updated with the closest points
REACH = 0.25  # of the size: largest move of a vertex in a round, so that the surface is flat enough
EVERY = np.eye(3)[None]  # all directions
AT_LIMIT = 1 - 1e-6  # share of the permitted distance from which a vertex is at its limit
WORSE = 2e-3  # loss of scaled Jacobian permitted for vertices to return to their goals
SMALL_LOSS = 0.05  # loss of scaled Jacobian of a hex whose vertices are moved back
INSIDE = 0.9  # share used of the permitted distance from exact features, which goals change a bit
# goals (N', 3), projectors (N' or 1, 3, 3) onto directions, and the permitted distances (N',) there
Limit = tuple[np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True, eq=False)
class Refit:
    """Positions (N', 3) of a neighbourhood, and their quality."""

    x: np.ndarray
    cost: float
    least: float  # smallest scaled Jacobian
    gap: np.ndarray  # (N',)
    strayed: np.ndarray  # (N',)


def refit(near: Neighbourhood, aim: float, before: float) -> Refit:
    """The best fit found of a neighbourhood with a sheet, which unfolds.

    near : the neighbourhood
    aim : scaled Jacobian above which hexes have no cost
    before : cost of the original mesh; fits with a much larger cost are abandoned
    """
    problem = near.problem
    x = problem.mesh.vertices.copy()
    lengths = problem.lengths(x, *RESHAPED)
    for weight in WEIGHTS:
        x = _descended(near, x, lengths, Terms(), 40, weight)
        lengths = problem.lengths(x, *KEPT)
    x = _descended(near, x, lengths, SETTLING, 30, WEIGHTS[-1])
    lengths = problem.lengths(x, *KEPT)
    x = at_goals(near, x, SNAPPED[0])
    best = evaluated(near, x, aim)
    for beta, most in zip(UNFOLD_BETAS, ABANDON, strict=True):
        x = _slid(near, x, lengths, beta)
        free, snapped = (evaluated(near, y, aim) for y in (x, at_goals(near, x, SNAPPED[1])))
        best = min(best, free, snapped, key=lambda each: each.cost)
        x = snapped.x if snapped.cost < UNFOLD_WORSE * free.cost else x
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
    springs = [pull(vertex, at.foot[free], at.facing[free], on, SLACK * on), *at.springs(every)]
    return problem.relax(x, lengths, terms, springs, iterations, near.moves)


def _slid(near: Neighbourhood, x: np.ndarray, lengths: np.ndarray, beta: float) -> np.ndarray:
    """Positions with a higher soft minimum of the scaled Jacobian; the boundary slides."""
    problem = near.problem
    all_indices = np.arange(len(problem.hexes)), np.arange(len(x))
    region = Region(*all_indices, problem.hexes, near.moves)
    at = goals_of(problem, x, near.matching, np.ones(len(x)))
    least = energy.least_determinant(x, problem.hexes, lengths)
    terms = SLIDING._replace(beta=beta, offset=UNFOLD_OFFSET, floor=energy.bound(least))
    return slid(problem, x, at, region, halved_energy(x, problem.hexes, lengths, terms), [], 25)


def fit_in_envelope(
    near: Neighbourhood,
    aim: float,
    width: float | np.ndarray,
    held: np.ndarray,
    on_surface: bool = False,
) -> tuple[Refit, Refit]:
    """The best positions found with the boundary in an envelope of the surface.

    Returns them moved back to their goals where the worst hex stays as good, and as found.

    near : the neighbourhood
    aim : scaled Jacobian above which hexes have no cost
    width : largest distance of vertices from their goals, in diagonals, or their present distance
        if that is larger; of all, or (N',) of each
    held : (N',) vertices that do not move
    on_surface : whether to start from positions moved back to their goals
    """
    problem, free = near.problem, replace(near, moves=near.moves & ~held)
    x = problem.mesh.vertices.copy()
    lengths = problem.lengths(x, *KEPT)
    at = goals_of(problem, x, near.matching, np.ones(len(x)))
    permitted = _permitted_distance(near, np.linalg.norm(x - at.place(problem, x), axis=1), width)
    best = evaluated(near, x, aim)
    x = at_goals(free, x, SNAPPED[0]) if on_surface else x
    for beta in np.repeat(BETAS, ROUNDS):
        least = energy.least_determinant(x, problem.hexes, lengths)
        if least <= 0 or best.least >= aim:
            break
        offset = float(problem.scaled_jacobian(x).min())
        terms = IN_ENVELOPE._replace(beta=beta, offset=offset, floor=energy.bound(least))
        reach = np.full(len(x), np.inf)
        reach[problem.outer] = REACH * problem.size(x)[problem.outer]
        limits = (x, EVERY, reach), (at.place(problem, x), _off(free, at), permitted)
        function = partial(_energy, free, halved_energy(x, problem.hexes, lengths, terms), limits)
        back = partial(reduce, _within_distance, limits)
        x = descend(function, x.copy(), ITERATIONS, retract=back)
        at = goals_of(problem, x, near.matching, np.ones(len(x)))
        x = _close_to_goals(free, at.place(problem, x), permitted, x, aim)
        best = min(best, evaluated(near, x, aim), key=lambda each: each.cost)
    least = min(aim, best.least)
    returned = evaluated(near, at_goals(free, best.x, least), aim)
    return returned if returned.least >= least - WORSE else best, best


def _energy(
    near: Neighbourhood, whole: Function, limits: tuple[Limit, Limit], x: np.ndarray
) -> tuple[float, np.ndarray]:
    value, gradient = whole(x)
    return value, reduce(partial(_inward, x), limits, gradient * near.moves[:, None])


def _inward(x: np.ndarray, gradient: np.ndarray, limit: Limit) -> np.ndarray:
    """Project a gradient: vertices at their limit do not move outwards, which ends a descent."""
    away, length, permitted = _away(x, limit)
    outward = away / np.maximum(length, 1e-300)[:, None]
    along = np.minimum((gradient * outward).sum(axis=1), 0) * (length > AT_LIMIT * permitted)
    return gradient - along[:, None] * outward


def _permitted_distance(
    near: Neighbourhood, gap: np.ndarray, width: float | np.ndarray
) -> np.ndarray:
    """(N',) permitted distance of each vertex from its goal, from its present distance (N',).

    It is smaller at small curves, which count as lost beyond a share of their size.
    """
    allowed = near.matching.allowed
    assert allowed is not None  # the matching is exact
    permitted = np.full(len(gap), width)
    on_feature = np.append(near.matching.curve, near.matching.corner)
    permitted[on_feature] = np.minimum(width, INSIDE * allowed)[on_feature]
    for route in near.matching.routes:
        own, share = route.vertices, Goal().limit(route.crease.size) / Goal.features
        permitted[own] = np.minimum(permitted[own], INSIDE * share * allowed[own])
    return np.maximum(permitted, gap)


def _off(near: Neighbourhood, at: Goals) -> np.ndarray:
    """(N', 3, 3) projector onto directions away from the surface, curve or corner."""
    off = np.zeros((len(near.moves), 3, 3))
    off[near.problem.outer] = at.facing[:, :, None] * at.facing[:, None]
    off[at.curve] = np.eye(3) - at.direction[:, :, None] * at.direction[:, None]
    off[at.corner] = np.eye(3)
    off[~near.moves] = 0
    return off


def _close_to_goals(
    near: Neighbourhood, goal: np.ndarray, permitted: np.ndarray, x: np.ndarray, aim: float
) -> np.ndarray:
    """Limit positions to the permitted distance from their goals, unless hexes become poor.

    Goals may have changed discontinuously near narrow gaps.
    """
    limited = _within_distance(x, (goal, EVERY * near.moves[:, None, None], permitted))
    least = np.minimum(near.problem.scaled_jacobian(x) - SMALL_LOSS, aim)
    while (poor := near.problem.scaled_jacobian(limited) < least).any():
        vertex = np.unique(near.problem.hexes[poor])
        if np.array_equal(limited[vertex], x[vertex]):
            break
        limited[vertex] = x[vertex]
    return limited


def _within_distance(x: np.ndarray, limit: Limit) -> np.ndarray:
    """Limit positions to the permitted distance from their goals, in some directions."""
    away, length, permitted = _away(x, limit)
    excess = np.maximum(1 - permitted / np.maximum(length, 1e-300), 0)
    return x - excess[:, None] * away


def _away(x: np.ndarray, limit: Limit) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Offsets (N', 3) from the goals in the directions of a limit, lengths, and limits (N',)."""
    goal, off, permitted = limit
    away = (off * (x - goal)[:, None]).sum(axis=2)
    return away, np.sqrt((away**2).sum(axis=1)), permitted
