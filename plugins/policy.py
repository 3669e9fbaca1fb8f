"""Policies: which move of the search is next."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from polycube.kinds import Estimate, Expected, Policy
from polycube.registry import build, choice, register, setting
from polycube.types.options import Options

# smallest expected gain for each unit of work, by effort
PRICE = {"first": float("inf"), "normal": 0.008, "thorough": 0.0008}
PATIENCE = 40.0  # work without a gain, after a valid mesh, that doubles the price
SMALL = 0.02  # gain that is none
# total work beyond which large moves are dearer after a valid mesh, by effort, and the factor
MOST = {"first": float("inf"), "normal": 100.0, "thorough": float("inf")}
LATE = 5.0
LARGE = 10.0  # expected work of a large move


@register("policy", "best_gain")
@dataclass(frozen=True)
class BestGain(Options, Policy):
    """The move with the largest expected gain for its work, while it is worth its price.

    While there is no mesh, every move is worth its price. After a valid mesh, the price rises with
    the work since the last gain, and with normal effort that of large moves is higher beyond a
    total work that takes about two minutes.

    Parameters
    ----------
    effort : first: the first mesh is the result; normal: the search ends when the goal is met, or
        when no move is worth its work; thorough: the same at a tenth of the price
    estimate : what a move gains, and what it costs
    """

    effort: Literal["first", "normal", "thorough"] = setting("effort", "normal")
    estimate: Mapping[str, object] = choice("estimate", "rules")

    def __call__(
        self, history: Any, possible: Callable[[], Sequence[Any]]
    ) -> Iterator[tuple[Any, Expected]]:
        """Moves in the order of their gain for their work."""
        return self.moves(history, possible, build("estimate", self.estimate))

    def moves(
        self, history: Any, possible: Callable[[], Sequence[Any]], estimate: Estimate
    ) -> Iterator[tuple[Any, Expected]]:
        """The same moves by a given estimate."""
        while history.shortfall > 0:
            rated = [(estimate(move, history), move) for move in possible()]
            if not rated:
                return
            expected, move = max(rated, key=lambda each: each[0].gain / each[0].work)
            is_free = history.leader is None and expected.gain > 0
            price = PRICE[self.effort] * self._factor(history, expected.work)
            if not is_free and expected.gain <= price * expected.work:
                return
            yield move, expected

    def _factor(self, history: Any, further: float) -> float:
        """Factor on the price of further work: it rises; 1 while there is no valid mesh."""
        if history.leader is None or not history.leader.verdict.is_valid:
            return 1.0
        work = [row.work for row in history.table]
        gains = [number for number, row in enumerate(history.table, 1) if row.gain > SMALL]
        rise = 1 + sum(work[max(gains, default=0) :]) / PATIENCE
        is_late = further > LARGE and sum(work) + further > MOST[self.effort]
        return rise * (LATE if is_late else 1)
