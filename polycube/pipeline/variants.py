"""Runs of the meshing stages on one structure, in variants that replace options of some stages.

Equal plugins with equal inputs are run once. `Acceptance` decides which mesh is the best.
"""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

from polycube.errors import InputError, MeshingError
from polycube.hexmesh.crossings import MOST_CROSSINGS, crossings
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.kinds import KINDS, Acceptance
from polycube.pipeline.deadline import Deadline
from polycube.pipeline.stages import Clock, Stage
from polycube.pipeline.state import RunState
from polycube.types import HexMesh, Verdict

logger = logging.getLogger(__name__)

Options = Mapping[str, Mapping[str, object]]  # options to replace, by stage
Name = tuple[int, bool]  # name of a run: its variant, and whether it was short
WORST = (-float("inf"),)
LARGE = 10_000  # number of hexes above which runs take long


@dataclass(frozen=True, eq=False)
class Attempt:
    """A run of the stages: its final state, the result of each stage, and its quality."""

    state: RunState
    path: tuple[object, ...]
    verdict: Verdict


@dataclass
class Variants:
    """Runs of the variants on one structure.

    Parameters
    ----------
    stages : all stages of the bundle
    variants : options to replace; an empty set means unchanged stages
    start : state from which the stages start
    trial : options of a short run, whose mesh may be the best
    gives_up : whether no other variant is tried after runs with many crossings only
    """

    stages: Sequence[Stage]
    variants: list[Options]
    start: RunState
    acceptance: Acceptance
    clock: Clock = field(default_factory=Clock)
    deadline: Deadline = field(default_factory=Deadline)
    trial: Options = field(default_factory=dict)
    gives_up: bool = False
    preferred: Name | None = None  # the run whose mesh is taken; None: the best
    _attempts: dict[Name, Attempt | MeshingError] = field(default_factory=dict)
    _memo: dict[tuple[object, ...], Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.variants = list(self.variants) or [{}]
        options = [*self.variants, self.trial]
        _check(self.stages, options)
        changed = {kind for each in options for kind in each}
        number = len(self.stages)
        while number and KINDS[(kind := self.stages[number - 1].kind)].once and kind not in changed:
            number -= 1
        self.stages, self._once = self.stages[:number], self.stages[number:]

    @property
    def attempts(self) -> dict[Name, Attempt]:
        """The successful runs."""
        return {n: each for n, each in self._attempts.items() if isinstance(each, Attempt)}

    @property
    def chosen(self) -> Name:
        """The run whose mesh is taken; raises MeshingError if all have failed."""
        found = self.attempts
        if not found:
            raise next(each for each in self._attempts.values() if isinstance(each, MeshingError))
        return self.preferred or max(found, key=lambda name: found[name].verdict.key)

    @property
    def best(self) -> tuple[float, ...]:
        """Key of the best mesh; lower than any other if there is none."""
        return max((each.verdict.key for each in self.attempts.values()), default=WORST)

    @property
    def reaches(self) -> float:
        """Scaled Jacobian of the best mesh if it has no deficiency, else -inf."""
        found = self.attempts
        return found[self.chosen].verdict.reaches if found else -float("inf")

    @property
    def is_hopeless(self) -> bool:
        """Whether no other variant is tried.

        That is so if all meshes so far are large and have inverted hexes, or, with
        `gives_up`, many crossings.
        """
        meshes = [each.state.hexes for each in self.attempts.values()]
        return bool(meshes) and all(mesh and self._is_lost(mesh) for mesh in meshes)

    def _is_lost(self, mesh: HexMesh) -> bool:
        if self.gives_up and len(crossings(mesh)) >= MOST_CROSSINGS:
            return True
        is_large = len(mesh.hexes) > LARGE
        return is_large and scaled_jacobian(mesh.vertices, mesh.hexes).min() <= 0

    def run(self, number: int, short: bool = False) -> Attempt | None:
        """Run a variant, the first one being 0; None if it fails."""
        name = f"{'trial of ' * short}variant {number + 1} of {len(self.variants)}"
        try:
            state, path = self._advance(self._chain(number, short), self.start)
            attempt = Attempt(state, path, self._judge(state))
        except MeshingError as error:
            logger.info("%s: %s", name, error)
            self._attempts[number, short] = error
            return None
        logger.info("%s: %s", name, attempt.verdict)
        self._attempts[number, short] = attempt
        return attempt

    def run_others(self) -> None:
        """Short runs of all variants without one, including the first, until one is good.

        There are none if `is_hopeless`: another structure is more promising then.
        """
        for number in range(len(self.variants)):
            if self.reaches >= self.acceptance.good or self.is_hopeless:
                return
            if (number, True) not in self._attempts:
                self.run(number, short=True)

    def run_again(self, options: Options, in_full: bool = False) -> tuple[Name, Attempt | None]:
        """Run the variant of the taken mesh with other options, as a new variant.

        in_full : in full even if that run was short
        """
        number, short = self.chosen
        short &= not in_full
        self.variants.append(_merged(self.variants[number], options))
        name = len(self.variants) - 1, short
        return name, self.run(*name)

    def best_short(self) -> tuple[tuple[float, ...], int] | None:
        """Key and number of the best variant with only a short run.

        None if short runs are not shorter than full ones.
        """
        if not self.trial:
            return None
        full = {number for number, short in self._attempts if not short}
        found = [
            (each.verdict.key, number)
            for (number, short), each in self.attempts.items()
            if short and number not in full
        ]
        return max(found, key=lambda each: each[0], default=None)

    def plugin(self, kind: str) -> object | None:
        """The plugin of a stage in the run whose mesh is taken."""
        return next((s.plugin for s in self._chain(*self.chosen) if s.kind == kind), None)

    def taken(self) -> Attempt:
        """The preferred run, or the best one."""
        return self.attempts[self.chosen]

    @property
    def reason(self) -> str:
        """Reason why the taken mesh is not valid, or why there is none."""
        if self.attempts:
            return "; ".join(self.taken().verdict.failures)
        return "; ".join({str(each): 0 for each in self._attempts.values()})

    def finish(self) -> tuple[RunState, tuple[object, ...]]:
        """Final state and the results of the stages; the last stages are run here, once."""
        taken = self.taken()
        state, path = self._advance(self._once, taken.state)
        return state, (*taken.path, *path)

    def _judge(self, state: RunState) -> Verdict:
        assert state.hexes is not None  # the chain was checked
        return self.acceptance(state.hexes, state.surface)

    def _chain(self, number: int, short: bool) -> list[Stage]:
        """The stages of a run, except those that are run once."""
        options = _merged(self.variants[number], self.trial if short else {})
        return [Stage(s.kind, replace(s.plugin, **options.get(s.kind, {}))) for s in self.stages]

    def _advance(
        self, stages: Sequence[Stage], state: RunState
    ) -> tuple[RunState, tuple[object, ...]]:
        """Run stages in sequence; equal plugins with equal inputs are run once."""
        path = []
        for stage in stages:
            key = _key(stage, state)
            if key not in self._memo:
                self._memo[key] = self._result(stage, state)
            value = self._memo[key]
            if isinstance(value, MeshingError):
                raise value
            state = stage.put(state, value)
            path.append(value)
        return state, tuple(path)

    def _result(self, stage: Stage, state: RunState) -> object:
        """The result of a stage, or its MeshingError; valid meshes are stored for the deadline."""
        try:
            value = self.clock.run(stage.kind, lambda: stage(state))
            if isinstance(value, HexMesh):
                self.deadline.note(stage.put(state, value), KINDS[stage.kind].fits)
        except MeshingError as error:
            return error
        finally:
            self.deadline.check()
        return value


def _merged(one: Options, other: Options) -> dict[str, dict[str, object]]:
    """Options of both, with precedence for the second."""
    return {kind: {**one.get(kind, {}), **other.get(kind, {})} for kind in {*one, *other}}


def _check(stages: Sequence[Stage], options: Iterable[Options]) -> None:
    """Raise InputError if options are replaced that the plugin of a stage does not have."""
    plugins = {stage.kind: stage.plugin for stage in stages}
    for kind, names in ((kind, each[kind]) for each in options for kind in each if kind in plugins):
        lacking = sorted(set(names) - {known.name for known in fields(plugins[kind])})
        if lacking:
            raise InputError(
                f"a variant of meshing sets {', '.join(lacking)} of {kind}, which "
                f"{type(plugins[kind]).__name__} does not have; use meshing.portfolio=[{{}}] and "
                "~meshing.trial, or define your own variants"
            )


def _key(stage: Stage, state: RunState) -> tuple[object, ...]:
    """Cache key of the result of a stage for a state."""
    others = [id(getattr(state, name)) for name in KINDS[stage.kind].takes if name != "hexes"]
    return stage.kind, repr(stage.plugin), _digest(state.hexes), *others


def _digest(mesh: HexMesh | None) -> str:
    if mesh is None:
        return ""
    data = hashlib.sha256(mesh.vertices.tobytes())
    data.update(mesh.hexes.tobytes())
    return data.hexdigest()
