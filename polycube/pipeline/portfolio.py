"""Variants of a chain of stages, run one by one; the best result is kept.

On more than one core, threads run ahead what will probably be asked for; see `ahead`.
"""

from __future__ import annotations

import hashlib
import logging
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from itertools import islice

from polycube.errors import InputError, MeshingError
from polycube.hexmesh.quality import scaled_jacobian
from polycube.kinds import KINDS
from polycube.pipeline.ahead import Ahead, Memo, Records, held, holding, replay
from polycube.pipeline.stages import Clock, Made, Stage, State, make

logger = logging.getLogger(__name__)

PROMISING = 0.55  # scaled Jacobian before the last stage; then enough on 18 of 19 parts
LARGE = 6000  # hexes; beyond, kernels use the cores themselves

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
    preferred: tuple[int, bool] | None = None  # the run whose result is kept; None: the best
    _found: dict[tuple[int, bool], tuple[State, list[object]]] = field(default_factory=dict)
    _failures: list[MeshingError] = field(default_factory=list)
    _memo: Memo = field(default_factory=Memo)
    _taken: set = field(default_factory=set)  # keys of the memo that the clock knows

    def __post_init__(self) -> None:
        self.variants = list(self.variants) or [{}]
        options = [*self.variants, self.trial or {}]
        _check(self.stages, options)
        changed = {kind for each in options for kind in each}
        self.stages, self._once = _split_off(self.stages, changed)

    @property
    def best(self) -> float:
        """Score of the best result; the worst of all before there is one."""
        return max(self.scores.values(), default=float("-inf"))

    @property
    def end(self) -> State:
        """State of the best result."""
        return self._found[self.chosen][0]

    @property
    def chosen(self) -> tuple[int, bool]:
        """The run whose result is kept: its variant, and whether it was short."""
        return self.preferred or max(self._found, key=self.scores.__getitem__)

    def run(
        self, number: int, short: bool = False, watch: Callable[[State], None] | None = None
    ) -> float:
        """Score of a variant, the first being 0; the worst of all where it fails.

        watch : is shown the state before the last stage
        """
        name = f"{'trial of ' * short}variant {number + 1} of {len(self.variants)}"
        end, path, value = dict(self.state), [], float("-inf")
        try:
            stages = self._chain(number, short)
            self._advance(stages[:-1], end, path)
            if watch is not None:
                watch(end)
            self._advance(stages[-1:], end, path)
        except MeshingError as error:
            self._failures.append(error)
            logger.info("%s: %s", name, error)
        else:
            value = self.score(end)
            logger.info("%s: score %.3f", name, value)
            self._found[number, short] = end, path
        self.scores[number, short] = value
        return value

    def chosen_plugin(self, kind: str) -> object | None:
        """The stage of a kind in the run whose result is kept."""
        return next((s.plugin for s in self._chain(*self.chosen) if s.kind == kind), None)

    def rerun(self, options: Options) -> tuple[tuple[int, bool], State | None]:
        """The run whose result is kept, as a new variant: its number, its state if it succeeds."""
        number, short = self.chosen
        self.variants.append(_merged(self.variants[number], options))
        name = len(self.variants) - 1, short
        self.run(*name)
        return name, self._found.get(name, (None,))[0]

    def prepare(self, number: int, short: bool = True) -> None:
        """Make what `run` will take, for it to find; nothing of large meshes."""
        state = dict(self.state)
        for stage in self._chain(number, short):
            made, _ = self._memo.get(*_work(stage, state))
            if made.error is not None or len(getattr(made.value, "hexes", ())) > LARGE:
                return
            state[KINDS[stage.kind].gives] = made.value

    def _chain(self, number: int, short: bool) -> list[Stage]:
        """The stages of a run, but those that come once."""
        options = _merged(self.variants[number], (self.trial or {}) if short else {})
        return [Stage(s.kind, replace(s.plugin, **options.get(s.kind, {}))) for s in self.stages]

    def _advance(self, stages: Sequence[Stage], state: State, path: list[object]) -> None:
        """Run stages on the state in place; equal plugins on equal hexes are run once."""
        for stage in stages:
            key, work = _work(stage, state)
            begin = time.perf_counter()
            made, records = self._memo.get(key, work)
            waited = time.perf_counter() - begin
            if key not in self._taken:
                self._taken.add(key)
                replay(records)
                self.clock.take(stage.kind, made, waited)
            if made.error is not None:
                raise made.error
            state[KINDS[stage.kind].gives] = made.value
            path.append(made.value)

    def try_others(self, enough: float, ahead: Ahead) -> None:
        """Short runs of all variants that had none, the first too, until one is enough."""
        others = [n for n in range(len(self.variants)) if (n, True) not in self.scores]
        if self.best < enough:
            ahead.begin(partial(self.prepare, number) for number in reversed(others))
        for number in others:
            if self.best >= enough:
                break
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
        end, path = self._found[self.chosen]
        self._advance(self._once, end, path)
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
    coming = _Coming(starts)
    with holding(), Ahead() as ahead:
        for start in coming:
            if not tried:
                _begin(start, coming, ahead, has_rival)
            elif start.run(0, short=True) <= max(each.best for each in tried):
                tried.append(start)
                continue
            else:
                ahead.drop()  # variants of a worse structure
            tried.append(start)
            if not is_settled(start):
                ahead.begin(partial(each.prepare, 0) for each in coming.look())
            if len(tried) > 1 or not has_rival:
                start.try_others(enough, ahead)
            if is_settled(start):
                break
        max(tried, key=lambda each: each.best).try_others(enough, ahead)
        short = [(*each, start) for start in tried for each in start.promising()]
        if short and max(each.best for each in tried) < enough:
            _, number, start = max(short, key=lambda each: each[0])
            start.run(number)
    return max(tried, key=lambda each: each.best)


class _Coming:
    """An iterator that may be asked for what comes next; what that logs is kept until its turn."""

    def __init__(self, starts: Iterable[Portfolio]) -> None:
        self._starts = iter(starts)
        self._next: list[tuple[Portfolio, Records]] = []

    def __iter__(self) -> Iterator[Portfolio]:
        while self._next or any(True for _ in self.look()):
            start, records = self._next.pop()
            replay(records)
            yield start

    def look(self) -> Iterator[Portfolio]:
        """The next one, if any."""
        with held() as records:
            if not self._next:
                self._next = [(start, records) for start in islice(self._starts, 1)]
        yield from (start for start, _ in self._next)


def _begin(start: Portfolio, coming: _Coming, ahead: Ahead, has_rival: bool) -> None:
    """Run the first variant in full; beside it, short runs of what follows where that is bad."""

    def watch(state: State) -> None:
        if _is_promising(state):
            ahead.drop()
        else:
            ahead.begin([partial(start.prepare, 0)])

    if has_rival:
        ahead.begin(partial(each.prepare, 0) for each in coming.look())
    ahead.begin(partial(start.prepare, n) for n in reversed(range(1, len(start.variants))))
    start.run(0, watch=watch)


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
    others = range(1, len(portfolio.variants))
    with holding(), Ahead() as ahead:
        ahead.begin(partial(portfolio.prepare, n, short=False) for n in reversed(others))
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


def _check(stages: Sequence[Stage], options: Iterable[Options]) -> None:
    """Raise InputError where options are to be replaced that a stage's plugin does not have."""
    plugins = {stage.kind: stage.plugin for stage in stages}
    for kind, names in ((kind, each[kind]) for each in options for kind in each if kind in plugins):
        lacking = sorted(set(names) - {known.name for known in fields(plugins[kind])})
        if lacking:
            raise InputError(
                f"a variant of meshing sets {', '.join(lacking)} of {kind}, which "
                f"{type(plugins[kind]).__name__} does not have; say meshing.portfolio=[{{}}] and "
                "~meshing.trial, or name variants of your own"
            )


def _work(stage: Stage, state: State) -> tuple[tuple, Callable[[], Made]]:
    """What tells the result of a stage on a state from others, and what makes it."""
    others = [id(state[name]) for name in KINDS[stage.kind].takes if name != "hexes"]
    key = (stage.kind, repr(stage.plugin), _digest(state.get("hexes")), *others)
    return key, lambda: make(stage.kind, lambda: stage(state))


def _is_promising(state: State) -> bool:
    hexes = state.get("hexes")
    return hexes is not None and scaled_jacobian(hexes.vertices, hexes.hexes).min() > PROMISING


def _digest(hexes: object) -> str:
    if hexes is None:
        return ""
    data = hashlib.sha256(hexes.vertices.tobytes())
    data.update(hexes.hexes.tobytes())
    return data.hexdigest()
