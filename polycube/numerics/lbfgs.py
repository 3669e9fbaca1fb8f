"""Limited-memory BFGS with a backtracking line search that supports infinite values."""

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import numpy as np
from numba import njit

MEMORY = 8  # pairs of steps and gradient changes
# length of the blocks of a product: BLAS may divide longer ones by the number of cores
BLOCK = 8192
STALL = 1e-9  # relative decrease that ends the search

Function = Callable[[np.ndarray], tuple[float, np.ndarray]]
_EFFORTS: ContextVar[tuple[Counter[str], ...]] = ContextVar("efforts", default=())
_CHECK: ContextVar[Callable[[], None] | None] = ContextVar("check", default=None)


@contextmanager
def interruptible(check: Callable[[], None]) -> Iterator[None]:
    """Call `check` at each evaluation of all descents in the context; it may raise to end them."""
    token = _CHECK.set(check)
    try:
        yield
    finally:
        _CHECK.reset(token)


@contextmanager
def counted(is_alone: bool = False) -> Iterator[Counter[str]]:
    """Count the effort of all descents in the context; may be nested.

    `steps` that were accepted, `evaluations`, and `work`, the evaluated coordinates.

    is_alone : do not count them in the outer contexts, which may belong to another thread; see
        `count_more`
    """
    effort: Counter[str] = Counter()
    token = _EFFORTS.set((effort,) if is_alone else (*_EFFORTS.get(), effort))
    try:
        yield effort
    finally:
        _EFFORTS.reset(token)


def count_more(more: Counter[str]) -> None:
    """Add steps and evaluations that were counted alone."""
    for effort in _EFFORTS.get():
        effort.update(more)


def descend(
    function: Function,
    x: np.ndarray,
    iterations: int,
    step: float = 1e-4,
    retract: Callable[[np.ndarray], np.ndarray] | None = None,
) -> np.ndarray:
    """Point of lower value, after at most the given number of accepted steps.

    function : x -> (value, gradient); values may be infinite, except at the start
    step : largest change of a coordinate in a first, unscaled step
    retract : projects a point onto the permitted set, which contains the start
    """
    back, check = retract or (lambda place: place), _CHECK.get()

    def evaluate(place: np.ndarray) -> tuple[float, np.ndarray]:
        if check is not None:
            check()
        _count("evaluations")
        _count("work", place.size)
        return function(place)

    value, gradient = evaluate(x)
    pairs = _Pairs(x.size)
    for _ in range(iterations):
        direction, slope = pairs.direction(gradient, step)
        if slope >= 0:
            pairs.number = 0
            direction, slope = pairs.direction(gradient, step)
        found = _backtrack(evaluate, back, x, value, direction, slope)
        if found is None:
            if not pairs.number:
                break
            pairs.number = 0
            continue
        moved, lower, turned = found
        pairs.add(moved - x, turned - gradient)
        _count("steps")
        decrease = value - lower
        x, value, gradient = moved, lower, turned
        if decrease < STALL * (abs(value) + 1e-12):
            break
    return x


def _count(what: str, number: int = 1) -> None:
    for effort in _EFFORTS.get():
        effort[what] += number


class _Pairs:
    """The last steps and gradient changes, which define the inverse Hessian estimate."""

    def __init__(self, size: int) -> None:
        self._changes, self._bends = np.empty((MEMORY, size)), np.empty((MEMORY, size))
        self._inverses = np.empty(MEMORY)  # inverse curvatures, change . bend
        self.number, self._next = 0, 0

    def add(self, change: np.ndarray, bend: np.ndarray) -> None:
        """Replace the oldest pair, unless the curvature of the new one is not clearly positive."""
        change, bend = change.reshape(-1), bend.reshape(-1)
        curvature = _dot(change, bend)
        if curvature > 1e-14 * np.sqrt(_dot(change, change) * _dot(bend, bend)):
            self._changes[self._next], self._bends[self._next] = change, bend
            self._inverses[self._next] = 1 / curvature
            self._next = (self._next + 1) % MEMORY
            self.number = min(self.number + 1, MEMORY)

    def direction(self, gradient: np.ndarray, step: float) -> tuple[np.ndarray, float]:
        """Inverse Hessian estimate times gradient, and the slope along it.

        step : largest change of a coordinate if there are no pairs
        """
        flat = np.ascontiguousarray(gradient, np.float64).reshape(-1)
        if self.number:
            order = (self._next - 1 - np.arange(self.number)) % MEMORY  # newest first
            direction = _two_loops(flat, self._changes, self._bends, self._inverses, order)
        else:
            direction = flat * (step / (np.abs(flat).max() + 1e-30))
        return direction.reshape(gradient.shape), -_dot(flat, direction)


@njit(cache=True, nogil=True)
def _dot(a: np.ndarray, b: np.ndarray) -> float:
    """Scalar product of vectors (n,), independent of the number of cores."""
    total = 0.0
    for start in range(0, len(a), BLOCK):
        total += np.dot(a[start : start + BLOCK], b[start : start + BLOCK])
    return total


@njit(cache=True, nogil=True)
def _two_loops(
    gradient: np.ndarray,
    changes: np.ndarray,
    bends: np.ndarray,
    inverses: np.ndarray,
    order: np.ndarray,
) -> np.ndarray:
    """Nocedal and Wright 2006, algorithm 7.4; pairs in order, the newest first."""
    direction = gradient.copy()
    shares = np.empty(len(order))
    for k in range(len(order)):
        i = order[k]
        shares[k] = inverses[i] * _dot(changes[i], direction)
        for j in range(len(direction)):
            direction[j] -= shares[k] * bends[i, j]
    newest = order[0]
    scale = 1 / (inverses[newest] * _dot(bends[newest], bends[newest]))
    for j in range(len(direction)):
        direction[j] *= scale
    for k in range(len(order) - 1, -1, -1):
        i = order[k]
        share = shares[k] - inverses[i] * _dot(bends[i], direction)
        for j in range(len(direction)):
            direction[j] += share * changes[i, j]
    return direction


def _backtrack(
    function: Function,
    retract: Callable[[np.ndarray], np.ndarray],
    x: np.ndarray,
    value: float,
    direction: np.ndarray,
    slope: float,
) -> tuple[np.ndarray, float, np.ndarray] | None:
    """First point along the direction with sufficient decrease (Armijo), or None."""
    length = 1.0
    for attempt in range(25):
        moved = retract(x - length * direction)
        lower, gradient = function(moved)
        if np.isfinite(lower) and lower <= value + 1e-4 * length * slope:
            return moved, lower, gradient
        length *= 0.5 if attempt < 4 else 0.25
    return None
