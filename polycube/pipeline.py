"""Run the stages one after the other, save what each makes, keep the best of a portfolio.

The state is a dict from the names in `kinds.KINDS` (surface, polycube, hexes ...) to values; a
stage takes some of them and gives one.  Nothing is computed before the whole chain is checked.
"""

from __future__ import annotations

import hashlib
import logging
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from polycube import artifacts
from polycube.errors import InputError, MeshingError
from polycube.geometry.descent import counted
from polycube.kinds import KINDS
from polycube.registry import build

logger = logging.getLogger(__name__)

State = dict[str, object]


@dataclass(frozen=True)
class Stage:
    """One step of a run: a plugin of a kind that takes and gives."""

    kind: str
    plugin: Callable[..., object]

    def __call__(self, state: Mapping[str, object]) -> object:
        """What the plugin makes of its part of the state."""
        return self.plugin(*(state[name] for name in KINDS[self.kind].takes))


@dataclass
class Clock:
    """Seconds, and effort of descent (`counted`), spent per stage, summed over repeats."""

    seconds: dict[str, float] = field(default_factory=dict)
    effort: dict[str, Counter[str]] = field(default_factory=dict)

    def run(self, name: str, call: Callable[[], object]) -> object:
        """Call, time, log one line; a bug or a failed computation names the stage it came from."""
        begin = time.perf_counter()
        with counted() as effort:
            try:
                return call()
            except (InputError, MeshingError):
                raise
            except Exception as error:
                logger.debug("stage %s failed", name, exc_info=True)
                raise MeshingError(
                    f"stage {name} failed: {type(error).__name__}: {error}"
                ) from error
            finally:
                spent = time.perf_counter() - begin
                self.seconds[name] = self.seconds.get(name, 0.0) + spent
                self.effort[name] = self.effort.get(name, Counter()) + effort
                numbers = [f"{spent:6.1f} s", *(f"{n} {what}" for what, n in effort.items())]
                logger.info("%-18s %s", name, ", ".join(numbers))


def build_stages(order: Sequence[str], configs: Mapping[str, Mapping[str, object]]) -> list[Stage]:
    """Build the plugin of every stage in `order`; raises InputError for a stage without config."""
    missing = [kind for kind in order if kind not in configs]
    if missing:
        raise InputError(f"no config for stage {missing[0]!r}; have {', '.join(configs)}")
    return [Stage(kind, build(kind, configs[kind])) for kind in order]


Options = Mapping[str, Mapping[str, object]]  # to replace, by stage


def run_portfolio(
    stages: Sequence[Stage],
    portfolio: Sequence[Options],
    state: State,
    clock: Clock,
    score: Callable[[State], float],
    enough: float = float("inf"),
    trial: Options | None = None,
) -> tuple[State, list[object]]:
    """Run the stages once per variant, from the first stage the variants change; keep the best.

    portfolio : options to replace, by stage; an empty one means the stages as they are.
    enough : score that ends the search
    trial : options of a short run; where the first variant is not enough, all have one, and only
        the best of the others is run in full.  A short run's result may be the best.
    Returns the best final state and the results of the stages on the way to it.  A variant that
    fails is passed over; raises MeshingError where all do.  Last stages of a kind that runs `once`
    run on the best alone.
    """
    portfolio = list(portfolio) or [{}]
    changed = {kind for variant in [*portfolio, trial or {}] for kind in variant}
    stages, once = _split_off(stages, changed)
    first = min((i for i, s in enumerate(stages) if s.kind in changed), default=len(stages))
    head, trail, memo = dict(state), [], {}
    _advance(stages[:first], head, trail, clock, memo)
    found, failures = [], []

    def run(number: int, short: Options) -> float:
        """Score of a variant, the first being 0; the worst of all where it fails."""
        name = f"{'trial of ' * bool(short)}variant {number + 1} of {len(portfolio)}"
        end, path, options = dict(head), list(trail), _merged(portfolio[number], short)
        tail = [Stage(s.kind, replace(s.plugin, **options.get(s.kind, {}))) for s in stages[first:]]
        try:
            _advance(tail, end, path, clock, memo)
        except MeshingError as error:
            failures.append(error)
            logger.info("%s: %s", name, error)
            return float("-inf")
        value = score(end)
        logger.info("%s: score %.3f", name, value)
        found.append((value, end, path))
        return value

    others = list(range(1, len(portfolio)))
    done = run(0, {}) >= enough
    if others and trial and not done:
        values = [run(number, trial) for number in range(len(portfolio))]
        done = max(values) >= enough
        others = [max(others, key=values.__getitem__)]
    for number in others:
        done = done or run(number, {}) >= enough
    if not found:
        raise failures[0]
    _, end, path = max(found, key=lambda each: each[0])
    _advance(once, end, path, clock, memo)
    return end, path


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


def save_stage(folder: Path, kind: str, value: object) -> None:
    """Keep what a stage made as `folder/stages/<kind>.npz`."""
    path = _stage_file(folder, kind)
    path.parent.mkdir(parents=True, exist_ok=True)
    artifacts.save(path, value)


def load_stage(folder: Path, kind: str) -> object:
    """What `save_stage` kept; raises InputError naming the stages that are there."""
    path = _stage_file(folder, kind)
    if not path.is_file():
        have = ", ".join(sorted(p.stem.replace(".", "/") for p in path.parent.glob("*.npz")))
        raise InputError(f"{folder} holds no result of stage {kind!r}; it holds {have or 'none'}")
    return artifacts.load(path)


def clear_stages(folder: Path) -> None:
    """Remove what an earlier run kept."""
    for path in (folder / "stages").glob("*.npz"):
        path.unlink()


def _stage_file(folder: Path, kind: str) -> Path:
    return folder / "stages" / f"{kind.replace('/', '.')}.npz"
