"""Move the vertices of a hex mesh until all hexes are valid."""

import numpy as np

from polycube.fitting.energy import Terms
from polycube.fitting.problem import RESHAPED, FitProblem
from polycube.fitting.springs import pull

WEIGHTS = 0.3 ** np.arange(12)  # of the springs that hold the boundary, in sequence
ITERATIONS = 50  # for each


def untangled(problem: FitProblem, x: np.ndarray, moves: np.ndarray | None = None) -> np.ndarray:
    """Positions (V, 3) with valid hexes if possible, with ever weaker springs at the boundary.

    x : (V, 3); returned unchanged if all hexes are valid
    moves : (V,) vertices that may move; None: all
    """
    place = x[problem.outer]
    for weight in WEIGHTS:
        if problem.scaled_jacobian(x).min() > 0:
            break
        every = weight / problem.size(x)[problem.outer] ** 2
        springs = pull(problem.outer, place, np.zeros_like(place), 0 * every, every)
        x = problem.relax(x, problem.lengths(x, *RESHAPED), Terms(), [springs], ITERATIONS, moves)
    return x
