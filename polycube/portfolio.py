"""Variants of a chain of stages, run one by one; the best result is kept."""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from polycube.errors import MeshingError
from polycube.kinds import KINDS
from polycube.pipeline import Clock, Stage, State

logger = logging.getLogger(__name__)

Options = Mapping[str, Mapping[str, object]]  # to replace, by stage


@dataclass
class Portfolio:
    """Variants of the stages on one state, run one by one; the best result is kept.

    stages : all of the backend's
    variants : options to replace, by stage; an empty one means the stages as they are
    trial : options of a short run, whose result may be the best; None where there is none
    """

    stages: Sequence[Stage]
    variants: Sequence[Options]
    state: State
    clock: Clock
    score: Callable[[State], float]
    trial: Options | None = None
    scores: dict[tuple[int, bool], float] = field(default_factory=dict)  # (variant, short or not)
    _found: list[tuple[float, State, list[object]]] = field(default_factory=list)
    _failures: list[MeshingError] = field(default_factory=list)
    _is_blocked: bool = False  # a stage that no variant changes has failed
    _memo: dict = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.variants = list(self.variants) or [{}]
        self._changed = {kind for options in [*self.variants, self.trial or {}] for kind in options}
        self.stages, self._once = _split_off(self.stages, self._changed)

    @property
    def best(self) -> float:
        """Score of the best result; the worst of all before there is one."""
        return max(self.scores.values(), default=float("-inf"))

    @property
    def end(self) -> State:
        """State of the best result."""
        return max(self._found, key=lambda each: each[0])[1]

    def run(self, number: int, short: bool = False) -> float:
        """Score of a variant, the first being 0; the worst of all where it fails."""
        name = f"{'trial of ' * short}variant {number + 1} of {len(self.variants)}"
        options = _merged(self.variants[number], (self.trial or {}) if short else {})
        stages = [Stage(s.kind, replace(s.plugin, **options.get(s.kind, {}))) for s in self.stages]
        first = next((i for i, s in enumerate(stages) if s.kind in self._changed), len(stages))
        end, path, value = dict(self.state), [], float("-inf")
        try:
            if self._is_blocked:
                raise self._failures[0]
            _advance(stages[:first], end, path, self.clock, self._memo)
            _advance(stages[first:], end, path, self.clock, self._memo)
        except MeshingError as error:
            self._is_blocked = len(path) < first
            self._failures.append(error)
            logger.info("%s: %s", name, error)
        else:
            value = self.score(end)
            logger.info("%s: score %.3f", name, value)
            self._found.append((value, end, path))
        self.scores[number, short] = value
        return value

    def try_others(self, enough: float) -> None:
        """Short runs of all variants that had none, the first too, until one is enough."""
        for number in range(len(self.variants)):
            if self.best >= enough:
                break
            if (number, True) not in self.scores:
                self.run(number, short=True)

    def promising(self) -> list[tuple[float, int]]:
        """Score and number of the variants that had a short run alone."""
        done = {number for number, short in self.scores if not short}
        return [(v, n) for (n, short), v in self.scores.items() if short and n not in done]

    def result(self) -> tuple[State, list[object]]:
        """The best final state and the results of the stages on the way to it.

        Raises MeshingError where all variants failed.  Last stages of a kind that runs `once` run
        on the best alone.
        """
        if not self._found:
            raise self._failures[0]
        _, end, path = max(self._found, key=lambda each: each[0])
        _advance(self._once, end, path, self.clock, self._memo)
        return end, path


def search(
    starts: Iterable[Portfolio],
    enough: float,
    is_settled: Callable[[Portfolio], bool],
    has_rival: bool = False,
) -> Portfolio:
    """The portfolio with the best result of those that start from one structure each.

    The first variant of the first start is run in full.  Where that is not enough all variants have
    short runs, another start's only where the short run of its first variant beats all results of
    the starts before.  Last, the best short run of all is run in full, unless a result is enough.

    enough : score that ends the runs of a start
    is_settled : whether no other start needs to be tried
    has_rival : compare the second start before the other variants of the first one
    """
    tried: list[Portfolio] = []
    for start in starts:
        if not tried:
            start.run(0)
        elif start.run(0, short=True) <= max(each.best for each in tried):
            tried.append(start)
            continue
        tried.append(start)
        if len(tried) > 1 or not has_rival:
            start.try_others(enough)
        if is_settled(start):
            break
    max(tried, key=lambda each: each.best).try_others(enough)
    short = [(*each, start) for start in tried for each in start.promising()]
    if short and max(each.best for each in tried) < enough:
        _, number, start = max(short, key=lambda each: each[0])
        start.run(number)
    return max(tried, key=lambda each: each.best)


def run_portfolio(
    stages: Sequence[Stage],
    variants: Sequence[Options],
    state: State,
    clock: Clock,
    score: Callable[[State], float],
    enough: float = float("inf"),
) -> tuple[State, list[object]]:
    """The best final state of all variants, and the results on the way; see `Portfolio`.

    enough : score that ends the search
    """
    portfolio = Portfolio(stages, variants, state, clock, score)
    for number in range(len(portfolio.variants)):
        if portfolio.run(number) >= enough:
            break
    return portfolio.result()


def _merged(one: Options, other: Options) -> dict[str, dict[str, object]]:
    """Options of both; the other's come first."""
    return {kind: {**one.get(kind, {}), **other.get(kind, {})} for kind in {*one, *other}}


def _split_off(
    stages: Sequence[Stage], changed: set[str]
) -> tuple[Sequence[Stage], Sequence[Stage]]:
    """The stages, and the last ones that run once and that no variant changes."""
    number = len(stages)
    while number and KINDS[stages[number - 1].kind].once and stages[number - 1].kind not in changed:
        number -= 1
    return stages[:number], stages[number:]


def _advance(
    stages: Sequence[Stage], state: State, path: list[object], clock: Clock, memo: dict
) -> None:
    """Run stages on the state in place; equal plugins on equal hexes are run once."""
    for stage in stages:
        others = [id(state[name]) for name in KINDS[stage.kind].takes if name != "hexes"]
        key = (stage.kind, repr(stage.plugin), _digest(state.get("hexes")), *others)
        if key not in memo:
            memo[key] = clock.run(stage.kind, lambda s=stage: s(state))
        state[KINDS[stage.kind].gives] = memo[key]
        path.append(memo[key])


def _digest(hexes: object) -> str:
    if hexes is None:
        return ""
    data = hashlib.sha256(hexes.vertices.tobytes())
    data.update(hexes.hexes.tobytes())
    return data.hexdigest()
