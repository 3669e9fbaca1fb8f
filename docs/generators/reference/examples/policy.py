from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from polycube.kinds import Expected, Policy
from polycube.registry import register


@register("policy", "first_valid")
@dataclass(frozen=True)
class FirstValid(Policy):
    """Make the possible moves in their order, until a mesh is valid."""

    def __call__(
        self, history: Any, possible: Callable[[], Sequence[Any]]
    ) -> Iterator[tuple[Any, Expected]]:
        while history.shortfall > 0 and (moves := possible()):
            if history.leader is not None and history.leader.verdict.is_valid:
                return
            yield moves[0], Expected(1.0, 1.0)
