"""Limited-memory BFGS with a backtracking line search that supports infinite values."""

from collections import Counter, deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import numpy as np

MEMORY = 8  # pairs of steps and gradient changes
# length of the blocks of a product: BLAS may divide longer ones by the number of cores
BLOCK = 8192
STALL = 1e-9  # relative decrease that ends the search

Function = Callable[[np.ndarray], tuple[float, np.ndarray]]
# steps (n,), gradient changes (n,) and the inverses of their products, the newest first
Pairs = deque[tuple[np.ndarray, np.ndarray, float]]
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
    pairs: Pairs = deque(maxlen=MEMORY)
    for _ in range(iterations):
        direction, slope = _direction(pairs, gradient, step)
        if slope >= 0:
            pairs.clear()
            direction, slope = _direction(pairs, gradient, step)
        found = _backtrack(evaluate, back, x, value, direction, slope)
        if found is None:
            if not pairs:
                break
            pairs.clear()
            continue
        moved, lower, turned = found
        _add(pairs, moved - x, turned - gradient)
        _count("steps")
        decrease = value - lower
        x, value, gradient = moved, lower, turned
        if decrease < STALL * (abs(value) + 1e-12):
            break
    return x


def _count(what: str, number: int = 1) -> None:
    for effort in _EFFORTS.get():
        effort[what] += number


def _direction(pairs: Pairs, gradient: np.ndarray, step: float) -> tuple[np.ndarray, float]:
    """Inverse Hessian estimate times gradient, and the slope along it.

    Nocedal and Wright 2006, algorithm 7.4.

    step : largest change of a coordinate if there are no pairs
    """
    flat = np.ascontiguousarray(gradient, np.float64).reshape(-1)
    if not pairs:
        direction = flat * (step / (np.abs(flat).max() + 1e-30))
        return direction.reshape(gradient.shape), -_dot(flat, direction)
    direction, shares = flat.copy(), []
    for change, bend, inverse in pairs:
        shares.append(inverse * _dot(change, direction))
        direction -= shares[-1] * bend
    _, newest, inverse = pairs[0]
    direction *= 1 / (inverse * _dot(newest, newest))
    for (change, bend, inverse), share in zip(reversed(pairs), reversed(shares), strict=True):
        direction += (share - inverse * _dot(bend, direction)) * change
    return direction.reshape(gradient.shape), -_dot(flat, direction)


def _add(pairs: Pairs, change: np.ndarray, bend: np.ndarray) -> None:
    """Add a pair, unless its curvature is not clearly positive."""
    change, bend = change.reshape(-1), bend.reshape(-1)
    curvature = _dot(change, bend)
    if curvature > 1e-14 * np.sqrt(_dot(change, change) * _dot(bend, bend)):
        pairs.appendleft((change, bend, 1 / curvature))


def _dot(a: np.ndarray, b: np.ndarray) -> float:
    """Scalar product of vectors (n,), independent of the number of cores."""
    cuts = [slice(start, start + BLOCK) for start in range(0, len(a), BLOCK)]
    return float(sum(np.dot(a[cut], b[cut]) for cut in cuts))


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
