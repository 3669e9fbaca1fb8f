"""Check the order of the stages of a run, build them, and run them in sequence with a clock."""

import logging
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from polycube.errors import InputError, MeshingError
from polycube.kinds import KINDS, STAGES
from polycube.numerics.lbfgs import counted
from polycube.registry import build
from polycube.state import RunState

logger = logging.getLogger(__name__)

RESULTS = ("hexes", "spline", "solution")  # outputs that need no later stage to be of use
Value = TypeVar("Value")


@dataclass(frozen=True)
class Stage:
    """One step of a run: a plugin of a kind with fields of the run state as input and output."""

    kind: str
    plugin: Any  # implements the Protocol of its kind

    def __call__(self, state: RunState) -> object:
        """The result of the plugin for its inputs from the state."""
        return self.plugin(*(getattr(state, name) for name in KINDS[self.kind].takes))

    def put(self, state: RunState, value: object) -> RunState:
        """The state with the result of the stage."""
        change: dict[str, Any] = {KINDS[self.kind].gives: value}
        return replace(state, **change)


@dataclass
class Clock:
    """Seconds and descent effort (`counted`) per step, summed over repetitions."""

    seconds: dict[str, float] = field(default_factory=dict)
    effort: dict[str, Counter[str]] = field(default_factory=dict)

    def run(self, name: str, call: Callable[[], Value]) -> Value:
        """Call a function, measure its time, without that of steps in it, and log one line.

        Raises InputError and MeshingError as the function; any other exception becomes a
        MeshingError with the name of the step.
        """
        logger.debug("%s begins", name, extra={"stage": name})
        begin = time.perf_counter() - sum(self.seconds.values())
        with counted() as effort:
            try:
                return call()
            except (InputError, MeshingError):
                raise
            except Exception as bug:
                logger.debug("stage %s failed", name, exc_info=True)
                raise MeshingError(f"stage {name} failed: {type(bug).__name__}: {bug}") from bug
            finally:
                self._note(name, time.perf_counter() - sum(self.seconds.values()) - begin, effort)

    def _note(self, name: str, spent: float, effort: Counter[str]) -> None:
        self.seconds[name] = self.seconds.get(name, 0.0) + spent
        self.effort[name] = self.effort.get(name, Counter()) + effort
        done = [f"{effort[n]} {n}" for n in ("evaluations", "steps") if n in effort]
        logger.info("%-18s %s", name, ", ".join([f"{spent:6.1f} s", *done]))


def build_stages(order: Sequence[str], configs: Mapping[str, Any]) -> list[Stage]:
    """Build the plugin of every stage in `order`; raises InputError for a missing configuration."""
    have = [kind for kind in configs if kind in KINDS]
    missing = [kind for kind in order if kind not in have]
    if missing:
        raise InputError(f"no config for stage {missing[0]!r}; have {', '.join(have)}")
    return [Stage(kind, build(kind, configs[kind])) for kind in order]


def meshing_stages(bundle: Mapping[str, Any], have: Sequence[str]) -> list[Stage]:
    """Stages of a meshing bundle in its order.

    Raises InputError if the stages do not form a chain from these fields to a spline.

    bundle : composed from a file of conf/meshing
    have : fields of the run state from which meshing starts
    """
    order = bundle["order"]
    check_chain([*order, "spline"], have)
    return build_stages(order, {f"meshing/{name}": value for name, value in bundle.items()})


def check_chain(order: Sequence[str], have: Iterable[str]) -> None:
    """Check that every stage has its inputs and that every output is used.

    Raises InputError if a stage is unknown, lacks an input, or its output is not used.

    order : kinds of stages, in the order in which they run
    have : fields of the run state that exist before the first stage
    """
    present = set(have)
    for number, stage in enumerate(order):
        if stage not in STAGES:
            raise InputError(f"{stage!r} is not a stage; the stages are {', '.join(STAGES)}")
        kind = KINDS[stage]
        missing = [name for name in kind.takes if name not in present]
        if missing:
            stages = ((name, KINDS[name]) for name in STAGES)
            makers = [n for n, own in stages if own.gives in missing and own.gives not in own.takes]
            hint = f"; put {' or '.join(makers)} before it" if makers else ""
            what = f"stage {stage!r} needs {', '.join(missing)}, which no earlier stage makes{hint}"
            raise InputError(what)
        rest = [KINDS[each] for each in order[number + 1 :] if each in KINDS]
        if kind.gives not in {*RESULTS, *(name for each in rest for name in each.takes)}:
            what = f"stage {stage!r} makes {kind.gives}, which no later stage uses; remove it"
            raise InputError(what)
        present.add(kind.gives)
