"""Run stages one after the other on a clock, and keep what each makes.

The state is a dict from the names in `kinds.KINDS` (surface, polycube, hexes ...) to values; a
stage takes some of them and gives one.  Nothing is computed before the whole chain is checked.
"""

from __future__ import annotations

import logging
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from polycube.errors import InputError, MeshingError
from polycube.io import artifacts
from polycube.kinds import KINDS
from polycube.numerics.lbfgs import counted
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


@dataclass(frozen=True, eq=False)
class Made:
    """What a call came to."""

    value: object
    error: InputError | MeshingError | None
    seconds: float  # that it took
    effort: Counter[str]  # of descent, see `counted`


@dataclass
class Clock:
    """Seconds, and effort of descent (`counted`), spent per stage, summed over repeats.

    A stage that was made on another thread counts with the seconds that were waited for it, so
    that the sum is time as it passed; its effort counts in full.
    """

    seconds: dict[str, float] = field(default_factory=dict)
    effort: dict[str, Counter[str]] = field(default_factory=dict)

    def run(self, name: str, call: Callable[[], object]) -> object:
        """Call, time, log one line; a bug or a failed computation names the stage it came from."""
        made = make(name, call)
        return self.take(name, made, made.seconds)

    def take(self, name: str, made: Made, waited: float) -> object:
        """The value of what was made, its time and one line noted; raises its error."""
        self.seconds[name] = self.seconds.get(name, 0.0) + waited
        self.effort[name] = self.effort.get(name, Counter()) + made.effort
        aside = [f"{made.seconds:.1f} s beside others"] if waited < made.seconds else []
        numbers = [f"{waited:6.1f} s", *aside, *(f"{n} {what}" for what, n in made.effort.items())]
        logger.info("%-18s %s", name, ", ".join(numbers))
        if made.error is not None:
            raise made.error
        return made.value


def make(name: str, call: Callable[[], object]) -> Made:
    """Call and time; an error becomes one that names the stage, unless it does already."""
    logger.debug("%s begins", name, extra={"stage": name})
    begin = time.perf_counter()
    value, error = None, None
    with counted() as effort:
        try:
            value = call()
        except (InputError, MeshingError) as refused:
            error = refused
        except Exception as bug:
            logger.debug("stage %s failed", name, exc_info=True)
            error = MeshingError(f"stage {name} failed: {type(bug).__name__}: {bug}")
            error.__cause__ = bug
    return Made(value, error, time.perf_counter() - begin, effort)


def build_stages(order: Sequence[str], configs: Mapping[str, Mapping[str, object]]) -> list[Stage]:
    """Build the plugin of every stage in `order`; raises InputError for a stage without config."""
    missing = [kind for kind in order if kind not in configs]
    if missing:
        raise InputError(f"no config for stage {missing[0]!r}; have {', '.join(configs)}")
    return [Stage(kind, build(kind, configs[kind])) for kind in order]


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
