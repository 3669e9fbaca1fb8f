"""Policies: which move of the search is next.

Imports `polycube` only.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from polycube.kinds import Expected, Policy
from polycube.registry import build, choice, register, setting

# smallest expected gain for each unit of work, by effort
PRICE = {"first": float("inf"), "normal": 0.008, "thorough": 0.0008}
PATIENCE = 40.0  # work without a gain, after a valid mesh, that doubles the price
SMALL = 0.02  # gain that is none
# work beyond which a search with a valid mesh makes small moves only, by effort
MOST = {"first": float("inf"), "normal": 100.0, "thorough": float("inf")}
FEW = 2.0  # expected work of a small move


@register("policy", "best_gain")
@dataclass(frozen=True)
class BestGain(Policy):
    """The move with the largest expected gain for its work, while it is worth its price.

    While there is no mesh, every move is worth its price. After a valid mesh, the price rises with
    the work since the last gain, and with normal effort, no large move exceeds a total work that
    takes about two minutes.

    Parameters
    ----------
    effort : first: the first mesh is the result; normal: the search ends when the goal is met, or
        when no move is worth its work; thorough: the same at a tenth of the price
    estimate : what a move gains, and what it costs
    """

    effort: str = setting("effort", "normal")
    estimate: Mapping[str, object] = choice("estimate", "rules")

    def __post_init__(self) -> None:
        if self.effort not in PRICE:
            raise ValueError(f"effort must be {', '.join(PRICE)}; got {self.effort!r}")

    def __call__(
        self, history: Any, possible: Callable[[], Sequence[Any]]
    ) -> Iterator[tuple[Any, Expected]]:
        """Moves in the order of their gain for their work."""
        estimate = build("estimate", self.estimate)
        while history.shortfall > 0:
            rated = [(estimate(move, history), move) for move in possible()]
            if history.leader is not None and history.leader.verdict.is_valid:
                left = max(FEW, MOST[self.effort] - sum(row.work for row in history.table))
                rated = [each for each in rated if each[0].work <= left]
            if not rated:
                return
            expected, move = max(rated, key=lambda each: each[0].gain / each[0].work)
            is_free = history.leader is None and expected.gain > 0
            price = PRICE[self.effort] * (1 + _fruitless(history) / PATIENCE)
            if not is_free and expected.gain <= price * expected.work:
                return
            yield move, expected


def _fruitless(history: Any) -> float:
    """Work of the moves since the last gain; 0 while there is no valid mesh."""
    if history.leader is None or not history.leader.verdict.is_valid:
        return 0.0
    gains = [number for number, row in enumerate(history.table, 1) if row.gain > SMALL]
    return sum(row.work for row in history.table[max(gains, default=0) :])
