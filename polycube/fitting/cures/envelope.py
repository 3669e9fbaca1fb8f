"""Raise the poor hexes of a neighbourhood with its boundary within an envelope of the surface.

Held exactly, a hex at an acute corner or between two curves that nearly touch cannot be better than
the angle there.  Here its boundary vertices may leave their goals by a small distance, as in the
envelope of Hu et al. 2020 (Fast tetrahedral meshing in the wild); those on curves and corners by
what is no loss of these.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from polycube.fitting import energy
from polycube.fitting.cures.neighbourhood import Neighbourhood
from polycube.fitting.cures.refit import Refit, judged
from polycube.fitting.energy import Terms
from polycube.fitting.snapping import goals_of
from polycube.fitting.springs import Springs, pull
from polycube.numerics.lbfgs import descend

HOLD = 0.1  # weight of a pull on the boundary to where it was, per square of the size
BETAS = (30.0, 60.0, 120.0, 250.0)  # sharpness of the soft minimum, round by round
ITERATIONS = 40


def envelopes(width: float) -> list[tuple[float, float]]:
    """Widths and holds to try one after the other, the most exact first."""
    return [(0.0, 0.0), (width / 3, 0.0), (width, 0.0), (width, HOLD)][: 4 if width else 1]


def loosened(near: Neighbourhood, aim: float, width: float, hold: float) -> Refit:
    """The best positions found.

    near : what is fitted
    aim : scaled Jacobian beyond which hexes cost nothing
    width : distance of vertices from their goals, in diagonals, at most; where they are farther
        already, at most as far
    hold : weight of a pull on the boundary to where it is, per square of the size
    """
    problem = near.problem
    x = problem.mesh.vertices.copy()
    lengths = problem.lengths(x, 2, 0.05)
    room = _room(near, x, width)

    def back(y: np.ndarray) -> np.ndarray:
        goal = _goals(near, y)
        away = y - goal
        distance = np.linalg.norm(away, axis=1)
        far = near.moves & (distance > room)
        y[far] = goal[far] + away[far] * (room[far] / distance[far])[:, None]
        return y

    start, every = x[problem.outer], hold / problem.size(x)[problem.outer] ** 2
    springs = pull(problem.outer, start, np.zeros_like(start), 0 * every, every)
    best = judged(near, x, aim)
    for beta in BETAS:
        least = energy.least_determinant(x, problem.hexes, lengths)
        offset = float(problem.scaled_jacobian(x).min())
        terms = Terms(1e-3, 1e-3, 0.05, 1.0, beta, offset, min(0.5 * least, 1e-3))
        function = partial(_energy, near, lengths, terms, springs)

        x = descend(function, x.copy(), ITERATIONS, retract=back)
        best = min(best, judged(near, x, aim), key=lambda each: each.cost)
        if best.least >= aim:
            break
    return best


def _energy(
    near: Neighbourhood, lengths: np.ndarray, terms: Terms, springs: Springs, x: np.ndarray
) -> tuple[float, np.ndarray]:
    value, gradient = energy.energy(x, near.problem.hexes, lengths, terms, springs)
    return value, gradient * near.moves[:, None]


def _room(near: Neighbourhood, x: np.ndarray, width: float) -> np.ndarray:
    """(N',) how far each vertex may be from its goal."""
    allowed = near.matching.allowed
    assert allowed is not None  # the matching is held exactly
    room = np.full(len(x), width)
    held = np.append(near.matching.curve, near.matching.corner)
    room[held] = np.minimum(width, allowed[held])
    return np.maximum(room, np.linalg.norm(x - _goals(near, x), axis=1))


def _goals(near: Neighbourhood, x: np.ndarray) -> np.ndarray:
    """(N', 3) where vertices should be; those inside are there."""
    return goals_of(near.problem, x, near.matching, np.ones(len(x))).place(near.problem, x)
