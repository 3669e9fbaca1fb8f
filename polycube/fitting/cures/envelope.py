"""Improve the poor hexes of a neighbourhood with its boundary in an envelope of the surface.

With an exact boundary, a hex at an acute corner or between two close curves cannot be better than
the angle there. Here boundary vertices may leave their goals by a small distance, as in the
envelope of Hu et al. 2020 (Fast tetrahedral meshing in the wild); vertices on curves and corners by
their permitted distance.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from polycube.fitting import energy
from polycube.fitting.creases.constraints import Goals
from polycube.fitting.cures.neighbourhood import Neighbourhood
from polycube.fitting.cures.refit import Refit, at_goals, evaluated
from polycube.fitting.energy import Terms
from polycube.fitting.snapping import goals_of
from polycube.fitting.springs import Springs, pull
from polycube.numerics.lbfgs import descend

HOLD = 0.1  # weight of the springs of the boundary to its position, per square of the size
BETAS = (30.0, 60.0, 120.0, 250.0)  # sharpness of the soft minimum, in sequence
ROUNDS = 2  # rounds for each; closest points are updated once per round
ITERATIONS = 20
REACH = 0.25  # of the size: largest move of a vertex in a round, so that the surface is flat enough
ALL_DIRECTIONS = np.eye(3)[None]
WORSE = 2e-3  # loss of scaled Jacobian permitted for vertices to return to their goals
SMALL_LOSS = 0.05  # loss of scaled Jacobian of a hex whose vertices are moved back


def envelopes(width: float) -> list[tuple[float, float]]:
    """Widths and spring weights to try in sequence, the most exact first."""
    return [(0.0, 0.0), (width, 0.0), (width, HOLD)] if width else [(0.0, 0.0)]


def fit_in_envelope(near: Neighbourhood, aim: float, width: float, hold: float) -> Refit:
    """The best positions found.

    near : the neighbourhood
    aim : scaled Jacobian above which hexes have no cost
    width : largest distance of vertices from their goals, in diagonals, or their present distance
        if that is larger
    hold : weight of the springs of the boundary to its position, per square of the size
    """
    problem = near.problem
    x = problem.mesh.vertices.copy()
    lengths = problem.lengths(x, 2, 0.05)
    at = goals_of(problem, x, near.matching, np.ones(len(x)))
    permitted = _permitted_distance(near, np.linalg.norm(x - at.place(problem, x), axis=1), width)
    start, every = x[problem.outer], hold / problem.size(x)[problem.outer] ** 2
    springs = pull(problem.outer, start, np.zeros_like(start), 0 * every, every)
    best = evaluated(near, x, aim)
    for beta in np.repeat(BETAS, ROUNDS):
        least = energy.least_determinant(x, problem.hexes, lengths)
        if least <= 0 or best.least >= aim:
            break
        offset = float(problem.scaled_jacobian(x).min())
        terms = Terms(1e-3, 1e-3, 0.05, 1.0, beta, offset, min(0.5 * least, 1e-3))
        function = partial(_energy, near, lengths, terms, springs)
        reach = np.full(len(x), np.inf)
        reach[problem.outer] = REACH * problem.size(x)[problem.outer]
        back = partial(_limited, x, reach, at.place(problem, x), _off(near, at), permitted)
        x = descend(function, x.copy(), ITERATIONS, retract=back)
        at = goals_of(problem, x, near.matching, np.ones(len(x)))
        x = _close_to_goals(near, at.place(problem, x), permitted, x, aim)
        best = min(best, evaluated(near, x, aim), key=lambda each: each.cost)
    return _returned_to_goals(near, best, aim)


def _returned_to_goals(near: Neighbourhood, found: Refit, aim: float) -> Refit:
    """Return vertices to their goals if no hex becomes poor or worse."""
    least = min(aim, found.least)
    returned = evaluated(near, at_goals(near, found.x, least), aim)
    return returned if returned.least >= least - WORSE else found


def _energy(
    near: Neighbourhood, lengths: np.ndarray, terms: Terms, springs: Springs, x: np.ndarray
) -> tuple[float, np.ndarray]:
    value, gradient = energy.energy(x, near.problem.hexes, lengths, terms, springs)
    return value, gradient * near.moves[:, None]


def _permitted_distance(near: Neighbourhood, gap: np.ndarray, width: float) -> np.ndarray:
    """(N',) permitted distance of each vertex from its goal, from its present distance (N',)."""
    allowed = near.matching.allowed
    assert allowed is not None  # the matching is exact
    permitted = np.full(len(gap), width)
    on_feature = np.append(near.matching.curve, near.matching.corner)
    permitted[on_feature] = np.minimum(width, allowed[on_feature])
    return np.maximum(permitted, gap)


def _off(near: Neighbourhood, at: Goals) -> np.ndarray:
    """(N', 3, 3) projector onto directions away from the surface, curve or corner."""
    off = np.zeros((len(near.moves), 3, 3))
    off[near.problem.outer] = at.facing[:, :, None] * at.facing[:, None]
    off[at.curve] = np.eye(3) - at.direction[:, :, None] * at.direction[:, None]
    off[at.corner] = np.eye(3)
    off[~near.moves] = 0
    return off


def _limited(
    start: np.ndarray,
    reach: np.ndarray,
    goal: np.ndarray,
    off: np.ndarray,
    permitted: np.ndarray,
    x: np.ndarray,
) -> np.ndarray:
    """Limit positions to the reach from the start of the round, and from their goals."""
    return _within_distance(goal, off, permitted, _within_distance(start, ALL_DIRECTIONS, reach, x))


def _close_to_goals(
    near: Neighbourhood, goal: np.ndarray, permitted: np.ndarray, x: np.ndarray, aim: float
) -> np.ndarray:
    """Limit positions to the permitted distance from their goals, unless hexes become poor.

    Goals may have changed discontinuously near narrow gaps.
    """
    limited = _within_distance(goal, ALL_DIRECTIONS * near.moves[:, None, None], permitted, x)
    least = np.minimum(near.problem.scaled_jacobian(x) - SMALL_LOSS, aim)
    while (poor := near.problem.scaled_jacobian(limited) < least).any():
        vertex = np.unique(near.problem.hexes[poor])
        if np.array_equal(limited[vertex], x[vertex]):
            break
        limited[vertex] = x[vertex]
    return limited


def _within_distance(
    goal: np.ndarray, off: np.ndarray, permitted: np.ndarray, x: np.ndarray
) -> np.ndarray:
    """Limit positions to the permitted distance from their goals."""
    away = np.einsum("vij,vj->vi", np.broadcast_to(off, (len(x), 3, 3)), x - goal)
    distance = np.linalg.norm(away, axis=1)
    excess = np.maximum(0, 1 - permitted / np.maximum(distance, 1e-30))
    return x - excess[:, None] * away
