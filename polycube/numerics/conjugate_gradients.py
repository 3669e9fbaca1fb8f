"""Solve a symmetric positive definite system with a preconditioner."""

import logging
from collections.abc import Callable

import numpy as np

from polycube.errors import MeshingError

logger = logging.getLogger(__name__)

TOLERANCE = 1e-12  # of the initial residual, in the norm of the preconditioner
ITERATIONS = 500  # largest number of iterations

Operator = Callable[[np.ndarray], np.ndarray]


def conjugate_gradients(
    matrix: Operator, right: np.ndarray, precondition: Operator, most: int = ITERATIONS
) -> np.ndarray:
    """Solution (N,) of A x = right (N,).

    precondition : approximate inverse; it may be in single precision, because directions are made
        conjugate with the change of the residual (Polak and Ribiere)

    Raises MeshingError if TOLERANCE is not reached within `most` iterations.
    """
    found, rest = np.zeros_like(right), right
    better = direction = precondition(rest)
    size = first = rest @ better
    for step in range(most):
        if size <= TOLERANCE**2 * first:
            logger.info("%d unknowns after %d steps", len(right), step)
            return found
        against = matrix(direction)
        length = size / (direction @ against)
        found = found + length * direction
        change, rest = -length * against, rest - length * against
        better = precondition(rest)
        direction = better + (better @ change) / size * direction
        size = rest @ better
    raise MeshingError(
        f"the solution did not converge in {most} steps: residual {np.sqrt(size / first):.1e}"
    )
