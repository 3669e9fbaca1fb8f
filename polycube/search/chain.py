"""Run meshing stages in sequence until the deadline; equal plugins with equal inputs run once.

The state of the process is not changed: the deadline is checked after each stage and at each step
of a descent, on the thread of the run.
"""

import hashlib
import logging
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from functools import partial
from typing import Any

from polycube.errors import InputError, MeshingError
from polycube.hexmesh.inspection import inspect
from polycube.kinds import KINDS, STAGES
from polycube.numerics.lbfgs import interruptible
from polycube.stages import Clock, Stage
from polycube.state import RunState
from polycube.types import HexMesh

logger = logging.getLogger(__name__)

RESERVE = 0.1  # share of the time that is kept for the files and the report
LEAST_RESERVE = 2.0  # seconds
HOPELESS = 50  # crossings after a stage; no mesh with more was valid in the end
HOPELESS_SHARE = 0.01  # of the hexes; large meshes recovered from more

Options = Mapping[str, Mapping[str, object]]  # options to replace, by stage
Results = Mapping[str, object]  # result of each stage, by its kind


class TimeIsUp(BaseException):
    """The time of the run is over."""


@dataclass
class Deadline:
    """The end of the time in which a run reads, proposes and meshes."""

    # time of the whole run, from the creation of this object; None for no limit
    seconds: float | None = None
    # set by another thread or by a signal handler to end the run
    interrupt: threading.Event = field(default_factory=threading.Event)
    _end: float = field(init=False, default=float("inf"))

    def __post_init__(self) -> None:
        if self.seconds is not None:
            reserve = min(max(RESERVE * self.seconds, LEAST_RESERVE), self.seconds / 2)
            self._end = time.monotonic() + self.seconds - reserve

    @property
    def is_over(self) -> bool:
        """Whether the time is over."""
        return time.monotonic() >= self._end

    @contextmanager
    def running(self) -> Iterator[None]:
        """Check the deadline at each step of a descent in the context."""
        with interruptible(self.check):
            yield

    def check(self) -> None:
        """Raise KeyboardInterrupt if the user ended the run, TimeIsUp at the time limit."""
        if self.interrupt.is_set():
            raise KeyboardInterrupt
        if self.is_over:
            raise TimeIsUp


@dataclass
class Chain:
    """Runs stages, remembers their results, and ends at the deadline."""

    clock: Clock = field(default_factory=Clock)  # measures the stages
    deadline: Deadline = field(default_factory=Deadline)  # checked after each stage
    # a fitted mesh with more pairs of quads that cross each other is not continued
    most_crossings: float = HOPELESS
    # the last state with hexes; its mesh may be taken if the deadline ends a move
    latest: RunState | None = None
    _memory: dict[tuple[object, ...], Any] = field(default_factory=dict)

    def run(
        self, stages: Sequence[Stage], state: RunState, options: Options
    ) -> tuple[RunState, Results]:
        """The state after the stages with replaced options, and the result of each stage.

        Raises MeshingError if a stage fails.
        """
        results = {}
        for stage in with_options(stages, options):
            key = _key(stage, state)
            if key not in self._memory:
                self._memory[key] = self._result(stage, state)
            value = self._memory[key]
            if isinstance(value, MeshingError):
                raise value
            state = stage.put(state, value)
            results[stage.kind] = value
        return state, results

    def _result(self, stage: Stage, state: RunState) -> object:
        """The result of a stage, or its MeshingError."""
        try:
            value = self.clock.run(stage.kind, partial(stage, state))
            if isinstance(value, HexMesh):
                is_fitted = KINDS[stage.kind].fits
                put = stage.put(state, value)
                self.latest = replace(put, unfitted=None if is_fitted else NOT_FITTED)
                number = len(inspect(value, state.surface).crossings) if is_fitted else 0
                if number > max(self.most_crossings, HOPELESS_SHARE * len(value.hexes)):
                    what = f"hopeless: {number} pairs of quads cross after {stage.kind}"
                    raise MeshingError(what)
        except MeshingError as error:
            return error
        finally:
            self.deadline.check()
        return value


NOT_FITTED = "the mesh is not fitted: its vertices are not on the surface yet"


def with_options(stages: Sequence[Stage], options: Options) -> list[Stage]:
    """The stages with replaced options of their plugins, as far as these have them."""
    own = [_known(stage.plugin, options.get(stage.kind, {})) for stage in stages]
    return [Stage(s.kind, replace(s.plugin, **new)) for s, new in zip(stages, own, strict=True)]


def _known(plugin: Any, options: Mapping[str, object]) -> dict[str, object]:
    names = {each.name for each in fields(plugin)}
    return {name: value for name, value in options.items() if name in names}


def merged(one: Options, other: Options) -> dict[str, dict[str, object]]:
    """Options of both, with precedence for the second."""
    return {kind: {**one.get(kind, {}), **other.get(kind, {})} for kind in {**one, **other}}


def variants_of(bundle: Mapping[str, Any]) -> list[Options]:
    """The variants of all lists of a meshing bundle: sets of options by stage."""
    lists = [value for value in bundle.values() if isinstance(value, Sequence)]
    sets = [each for value in lists for each in value if isinstance(each, Mapping)]
    return [each for each in sets if all(kind in STAGES for kind in each)]


def check_options(stages: Sequence[Stage], bundle: Mapping[str, Any]) -> None:
    """Check that the plugins of stages have the options that variants replace.

    Variants of particular structures are for the plugins of the bundle: others do without them.
    Raises InputError if an option of `meshing.portfolio` is missing.
    """
    plugins = {stage.kind: stage.plugin for stage in stages}
    for name, value in bundle.items():
        variants = variants_of({name: value})
        for kind, replaced in [(k, each[k]) for each in variants for k in each if k in plugins]:
            lacking = sorted(set(replaced) - set(_known(plugins[kind], replaced)))
            if not lacking:
                continue
            lacks = f"{type(plugins[kind]).__name__} does not have"
            why = f"a variant of meshing.{name} sets {', '.join(lacking)} of {kind}, which {lacks}"
            if name == "portfolio":
                what = f"{why}; use meshing.portfolio=[{{}}], or define your own variants"
                raise InputError(what)
            logger.info("%s", why)


def _key(stage: Stage, state: RunState) -> tuple[object, ...]:
    """Key of the result of a stage for a state; the objects of a state live as long as the run."""
    others = [id(getattr(state, name)) for name in KINDS[stage.kind].takes if name != "hexes"]
    digest, mesh = hashlib.sha256(), state.hexes
    for array in () if mesh is None else (mesh.vertices, mesh.hexes):
        digest.update(array.tobytes())
    return stage.kind, repr(stage.plugin), digest.hexdigest(), *others
