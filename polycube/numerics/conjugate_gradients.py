"""Solve a symmetric positive definite system with a preconditioner."""

from collections.abc import Callable

import numpy as np

TOLERANCE = 1e-12  # of the initial residual, in the norm of the preconditioner
ITERATIONS = 500  # largest number of iterations

Operator = Callable[[np.ndarray], np.ndarray]


def conjugate_gradients(
    matrix: Operator,
    right: np.ndarray,
    precondition: Operator,
    most: int = ITERATIONS,
    tolerance: float = TOLERANCE,
) -> tuple[np.ndarray, int, float]:
    """Solution of A x = right, number of steps, and residual relative to `right`.

    precondition : approximate inverse; it may be in single precision, because directions are made
        conjugate with the change of the residual (Polak and Ribiere)
    most : largest number of steps
    tolerance : of the residual, in the norm of the preconditioner
    """
    found, rest = np.zeros_like(right), right
    better = direction = precondition(rest)
    size = first = np.vdot(rest, better)
    step, residual = 0, float(first > 0)
    while residual > tolerance and step < most:
        against = matrix(direction)
        length = size / np.vdot(direction, against)
        found += length * direction
        against = length * against
        rest = rest - against
        better = precondition(rest)
        direction = better - np.vdot(better, against) / size * direction
        size = np.vdot(rest, better)
        step, residual = step + 1, np.sqrt(max(size, 0) / first)
    return found, step, residual
