"""Build the stages of a run, and run them one by one on a clock."""

from __future__ import annotations

import logging
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from polycube.errors import InputError, MeshingError
from polycube.kinds import KINDS, check_chain
from polycube.numerics.lbfgs import counted
from polycube.pipeline.state import RunState
from polycube.registry import build

logger = logging.getLogger(__name__)

Value = TypeVar("Value")


@dataclass(frozen=True)
class Stage:
    """One step of a run: a plugin of a kind that takes and gives fields of the run state."""

    kind: str
    plugin: Any  # of the Protocol of its kind

    def __call__(self, state: RunState) -> object:
        """What the plugin makes of its part of the state."""
        return self.plugin(*(getattr(state, name) for name in KINDS[self.kind].takes))

    def put(self, state: RunState, value: object) -> RunState:
        """The state with what the stage gave."""
        change: dict[str, Any] = {KINDS[self.kind].gives: value}
        return replace(state, **change)


@dataclass
class Clock:
    """Seconds, and effort of descent (`counted`), spent per step, summed over repeats."""

    seconds: dict[str, float] = field(default_factory=dict)
    effort: dict[str, Counter[str]] = field(default_factory=dict)

    def run(self, name: str, call: Callable[[], Value]) -> Value:
        """Call, time and log one line.

        Raises
        ------
        InputError, MeshingError
            As the call does; any other exception becomes a MeshingError that names the step.
        """
        logger.debug("%s begins", name, extra={"stage": name})
        begin = time.perf_counter()
        with counted() as effort:
            try:
                return call()
            except (InputError, MeshingError):
                raise
            except Exception as bug:
                logger.debug("stage %s failed", name, exc_info=True)
                raise MeshingError(f"stage {name} failed: {type(bug).__name__}: {bug}") from bug
            finally:
                self._note(name, time.perf_counter() - begin, effort)

    def _note(self, name: str, spent: float, effort: Counter[str]) -> None:
        self.seconds[name] = self.seconds.get(name, 0.0) + spent
        self.effort[name] = self.effort.get(name, Counter()) + effort
        numbers = [f"{spent:6.1f} s", *(f"{n} {what}" for what, n in effort.items())]
        logger.info("%-18s %s", name, ", ".join(numbers))


def build_stages(order: Sequence[str], configs: Mapping[str, Any]) -> list[Stage]:
    """Build the plugin of every stage in `order`; raises InputError for a stage without config."""
    missing = [kind for kind in order if kind not in configs]
    if missing:
        raise InputError(f"no config for stage {missing[0]!r}; have {', '.join(configs)}")
    return [Stage(kind, build(kind, configs[kind])) for kind in order]


def meshing_stages(bundle: Mapping[str, Any], have: Sequence[str]) -> list[Stage]:
    """Stages of a meshing bundle in its order.

    Parameters
    ----------
    bundle : composed from a file of conf/meshing
    have : fields of the run state that meshing starts from

    Raises
    ------
    InputError
        For an order that is no chain from these to a spline.
    """
    order = bundle["order"]
    check_chain([*order, "spline"], have)
    return build_stages(order, {kind: bundle[kind.removeprefix("meshing/")] for kind in order})
