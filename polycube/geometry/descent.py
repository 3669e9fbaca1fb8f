"""Limited-memory BFGS with a backtracking line search that steps back from infinite values."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from threading import Event

import numpy as np

MEMORY = 8  # pairs of steps and gradient changes
STALL = 1e-9  # relative decrease that ends the search

Function = Callable[[np.ndarray], tuple[float, np.ndarray]]
_EFFORTS: ContextVar[tuple[Counter[str], ...]] = ContextVar("efforts", default=())
_STOP: ContextVar[Event | None] = ContextVar("stop", default=None)


class Stopped(BaseException):
    """Nobody wants the result of a descent any more: see `stoppable`."""


@contextmanager
def stoppable(stop: Event) -> Iterator[None]:
    """Descents inside raise Stopped at their next evaluation once the event is set."""
    token = _STOP.set(stop)
    try:
        yield
    finally:
        _STOP.reset(token)


@contextmanager
def counted() -> Iterator[Counter[str]]:
    """Number of accepted `steps`, and of `evaluations`, of all descents inside; may be nested."""
    effort: Counter[str] = Counter()
    token = _EFFORTS.set((*_EFFORTS.get(), effort))
    try:
        yield effort
    finally:
        _EFFORTS.reset(token)


def descend(
    function: Function,
    x: np.ndarray,
    iterations: int,
    step: float = 1e-4,
    retract: Callable[[np.ndarray], np.ndarray] | None = None,
) -> np.ndarray:
    """Point of lower value, after at most so many accepted steps.

    function : x -> (value, gradient); values may be infinite, except at the start
    step : largest change of a coordinate in a first, unscaled step
    retract : brings a point back to where the search has to stay, as x is
    """
    back, stop = retract or (lambda place: place), _STOP.get()

    def evaluate(place: np.ndarray) -> tuple[float, np.ndarray]:
        if stop is not None and stop.is_set():
            raise Stopped
        _count("evaluations")
        return function(place)

    value, gradient = evaluate(x)
    pairs: deque[tuple[np.ndarray, np.ndarray, float]] = deque(maxlen=MEMORY)
    for _ in range(iterations):
        direction = _direction(gradient, pairs, step)
        slope = -_dot(gradient, direction)
        if slope >= 0:
            pairs.clear()
            direction = _direction(gradient, pairs, step)
            slope = -_dot(gradient, direction)
        found = _backtrack(evaluate, back, x, value, direction, slope)
        if found is None:
            if not pairs:
                break
            pairs.clear()
            continue
        moved, lower, turned = found
        change, bend = moved - x, turned - gradient
        curvature = _dot(change, bend)
        if curvature > 1e-14 * np.sqrt(_dot(change, change) * _dot(bend, bend)):
            pairs.append((change, bend, 1 / curvature))
        _count("steps")
        decrease = value - lower
        x, value, gradient = moved, lower, turned
        if decrease < STALL * (abs(value) + 1e-12):
            break
    return x


def _count(what: str) -> None:
    for effort in _EFFORTS.get():
        effort[what] += 1


def _dot(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.vdot(a, b))


def _direction(gradient: np.ndarray, pairs: deque, step: float) -> np.ndarray:
    """Inverse Hessian estimate times gradient (two loops over the pairs)."""
    if not pairs:
        return gradient * (step / (np.abs(gradient).max() + 1e-30))
    direction = gradient.copy()
    shares = []
    for change, bend, inverse in reversed(pairs):
        shares.append(inverse * _dot(change, direction))
        direction -= shares[-1] * bend
    change, bend, inverse = pairs[-1]
    direction *= 1 / (inverse * _dot(bend, bend))
    for (change, bend, inverse), share in zip(pairs, reversed(shares), strict=True):
        direction += (share - inverse * _dot(bend, direction)) * change
    return direction


def _backtrack(
    function: Function,
    retract: Callable[[np.ndarray], np.ndarray],
    x: np.ndarray,
    value: float,
    direction: np.ndarray,
    slope: float,
) -> tuple[np.ndarray, float, np.ndarray] | None:
    """First point along the direction with enough decrease (Armijo), or None."""
    length = 1.0
    for attempt in range(25):
        moved = retract(x - length * direction)
        lower, gradient = function(moved)
        if np.isfinite(lower) and lower <= value + 1e-4 * length * slope:
            return moved, lower, gradient
        length *= 0.5 if attempt < 4 else 0.25
    return None
