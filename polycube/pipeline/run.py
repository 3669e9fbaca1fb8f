"""The steps of a run, in order: from the surface of a part to the solution on its spline."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path
from threading import Event

from polycube.analysis.boundary_sets import check_names
from polycube.analysis.preconditioner import is_factored
from polycube.errors import InputError, MeshingError
from polycube.hexmesh.cad_faces import with_sets
from polycube.hexmesh.generation.requests import requests_of
from polycube.hexmesh.generation.requests_met import check_requests, unmet
from polycube.hexmesh.named_sets import sets_of_spline
from polycube.kinds import KINDS, Acceptance, Export, Ranking
from polycube.numerics import memory
from polycube.pipeline.choices import (
    can_be_better,
    choose,
    drawn_to_compare,
    is_drawn,
    is_fine,
    is_overlay,
    is_unnecessary,
    spares_of,
    structures_to_mesh,
    sufficient_jacobian,
    variants_of,
)
from polycube.pipeline.deadline import Deadline, TimeIsUp
from polycube.pipeline.guarantee import in_order, is_usable, last_attempt, wrong_topology
from polycube.pipeline.primitives import voxels
from polycube.pipeline.proposals import Proposals
from polycube.pipeline.reruns.creases import check_creases, creases_missed, meet_creases
from polycube.pipeline.reruns.requests import meet_requests
from polycube.pipeline.reruns.sizes import keep_features, meet_deviation
from polycube.pipeline.resume.results import StageResults
from polycube.pipeline.resume.settings import warn_of_changed_settings
from polycube.pipeline.search import compare, search
from polycube.pipeline.settings import Node, Settings
from polycube.pipeline.stages import Clock, Stage, build_stages, meshing_stages
from polycube.pipeline.state import RunState
from polycube.pipeline.variants import Variants
from polycube.registry import build
from polycube.structure.labels import nearest_labels
from polycube.structure.lattice import describe
from polycube.types import HexMesh, Ranked

logger = logging.getLogger(__name__)

Read = Callable[[Settings, Clock], RunState]


class Run:
    """The steps of a run. All plugins are built and checked at the start.

    Parameters
    ----------
    settings : settings of the run
    read : makes the first state: a surface, or a surface with a hex mesh to improve
    interrupt : set by another thread or by a signal handler to end the run

    Raises
    ------
    InputError
        If a plugin, an option or the order of the stages is invalid.
    """

    preparation: tuple[str, ...] = ("read", "structure")  # stages before the meshing stages

    def __init__(self, settings: Settings, read: Read, interrupt: Event | None = None) -> None:
        self.settings = settings
        self.clock = Clock()
        self.deadline = Deadline(settings.seconds, interrupt or Event())
        self._stored: tuple[Sequence[Ranked], int] | None = None  # structures, and the chosen one
        self._read = read
        try:
            self.requests = requests_of(settings.meshing.get("at") or ())
        except ValueError as error:
            raise InputError(str(error), "meshing.at") from None
        self.creases = settings.meshing.get("creases")
        try:
            check_creases(self.creases)
        except ValueError as error:
            raise InputError(str(error), "meshing.creases") from None
        self.acceptance: Acceptance = build("acceptance", settings.acceptance)
        self.meshing = meshing_stages(self.bundle, self.start_fields)
        self.solving = self._solving()
        self.primitives = voxels(settings.primitives["use"])
        ranking: Ranking = build("ranking", settings.ranking)
        self.proposals = Proposals(settings, self.primitives, ranking, self.clock)
        self.names = [*self.preparation, *(s.kind for s in (*self.meshing, *self.solving))]
        if settings.resume and settings.start not in self.names:
            raise InputError(
                f"resume needs the first stage to run again, from=STAGE; got {settings.start}, "
                f"have {', '.join(self.names)}"
            )
        loaded = self.names[: self.names.index(str(settings.start))] if settings.resume else ()
        self.results = StageResults(settings.resume, loaded)

    def _solving(self) -> list[Stage]:
        """The stages after meshing."""
        wanted = [kind for kind in ("spline", "analysis") if kind in self.settings.order]
        return build_stages(wanted, self.settings.composed)

    @property
    def bundle(self) -> Node:
        """The meshing stages and their variants."""
        return self.settings.meshing

    @property
    def start_fields(self) -> tuple[str, ...]:
        """Fields of the state that meshing starts from."""
        return ("surface", "polycube", "rough_map", "blocks", "parametrization")

    def begin(self) -> RunState:
        """Read the part and propose its structure.

        Raises
        ------
        InputError
            If the input is invalid, or if no proposal fits the part.
        """
        if self.results.is_loaded("read"):
            state = self.load_input()
        else:
            state = self._read(self.settings, self.clock)
        for warning in state.warnings:
            logger.warning("warning: %s", warning)
        self.settings = self.settings.in_unit(state.surface.unit)
        self.solving = self._solving()
        check_requests(state.surface, self.requests)
        return self.propose(state)

    def load_input(self) -> RunState:
        """The input of the resumed run."""
        surface, path, warnings, repair, *rest = self.results.load("read")
        points = rest[0] if rest else None  # older runs stored no points
        return RunState(surface, path=path, warnings=tuple(warnings), repair=repair, points=points)

    def propose(self, state: RunState) -> RunState:
        """Propose polycubes, rank them and choose the best."""
        if self.results.is_loaded("structure"):
            ranked, chosen = self.results.load("structure")
            return choose(replace(state, ranked=ranked), chosen, self.primitives)
        ranked = self.proposals.ranked(state.surface)
        return choose(replace(state, ranked=ranked), 0, self.primitives)

    def store_input(self, state: RunState, folder: Path) -> None:
        """Store the input in the results folder; from here on, results are stored there."""
        self.results.folder = folder
        if self.settings.resume:
            remaining = [name for name in self.names if not self.results.is_loaded(name)]
            warn_of_changed_settings(self.settings.resume, self.settings.composed, remaining)
        warnings = list(state.warnings)
        value = [state.surface, state.path, warnings, state.repair, state.points]
        self.results.store("read", value)
        self.store_start(state)

    def store_start(self, state: RunState) -> None:
        """Store the state from which meshing starts, unless it is stored already."""
        if self._stored != (state.ranked, state.chosen):
            self.results.store("structure", [state.ranked, state.chosen])
            self._stored = state.ranked, state.chosen

    def mesh(self, state: RunState) -> RunState:
        """Make the hexes on the best structure; see `polycube.pipeline.search`.

        At the time limit, or if the user ends the run, the result is the best valid mesh so far.

        Raises
        ------
        KeyboardInterrupt
            If the user ended the run before there was a valid mesh.
        MeshingError
            If every variant failed.
        """
        loaded = [stage for stage in self.meshing if self.results.is_loaded(stage.kind)]
        remaining = self.meshing[len(loaded) :]
        for stage in loaded:
            value = self.results.load(stage.kind)
            state = stage.put(state, value)
            self.results.store(stage.kind, value)
        if remaining:
            state = self._mesh_in_time(state, remaining, bool(loaded))
        return self.finish_mesh(state)

    def finish_mesh(self, state: RunState) -> RunState:
        """Name the parts of the boundary, label the surface and judge the mesh."""
        unit = self.settings.unit(state.surface.unit)
        hexes = replace(with_sets(_hexes(state), state.surface), unit=unit)
        labels = state.labels
        if labels is None and state.polycube is not None and state.parametrization is not None:
            labels = nearest_labels(state.surface, state.polycube, state.parametrization)
        verdict = self.acceptance(hexes, state.surface)
        missed = creases_missed(hexes, state.surface, self.creases)
        for sentence in chain(unmet(hexes, state.surface, self.requests), missed):
            logger.warning("warning: %s", sentence)
            verdict = replace(verdict, warnings=(*verdict.warnings, sentence))
        state = replace(state, hexes=hexes, labels=labels, verdict=verdict)
        first = [state.unfitted or "", wrong_topology(state)]
        failures = [*filter(None, first), *verdict.failures]
        if not failures and self.settings.strict and verdict.warnings:
            failures = [f"strict=true: {verdict.warnings[0]}"]
        return replace(state, failure="; ".join(failures)) if failures else state

    def solve(self, state: RunState) -> RunState:
        """Build the spline on the hexes and solve the analysis on it."""
        for stage in self.solving:
            if self.results.is_loaded(stage.kind):
                value = self.results.load(stage.kind)
            else:
                if stage.kind == "analysis" and state.spline is not None:
                    memory.warn(len(state.spline.control), is_factored(state.spline))
                value = self.clock.run(stage.kind, partial(stage, state))
            state = stage.put(state, value)
            if stage.kind == "spline" and state.spline is not None:
                sets = sets_of_spline(state.spline, _hexes(state))
                state = replace(state, spline=replace(state.spline, sets=sets))
                value = state.spline
            self.results.store(stage.kind, value)
        return state

    def search(self, state: RunState, stages: list[Stage], is_resumed: bool) -> RunState:
        """Mesh the promising structures, and return the best mesh.

        Parameters
        ----------
        stages : the meshing stages to run
        is_resumed : whether the state has results of earlier stages on the chosen structure, which
            is then the only one
        """
        ranked = state.ranked
        tries = self.settings.tries
        choices = [state.chosen] if is_resumed else structures_to_mesh(ranked, tries)
        made: list[Variants] = []  # variants of the structures so far

        def begin(index: int) -> Variants:
            start = state if index == state.chosen else choose(state, index, self.primitives)
            logger.info("meshing structure %d: %s", index, _described(start))
            made.append(self.variants(start, stages))
            return made[-1]

        def starts() -> Iterator[Variants]:
            for index in choices:
                if is_overlay(ranked[index]):
                    for each in made:  # coarse structures have all their variants first
                        each.run_others()
                if is_unnecessary(ranked[index], made):
                    break
                yield begin(index)

        def is_settled(tried: Variants) -> bool:
            index, left = tried.start.chosen, choices[len(made) :]
            limit = sufficient_jacobian(ranked, [index, *left], index, self.acceptance)
            return tried.reaches >= limit and not tried.taken().verdict.warnings

        first = sufficient_jacobian(ranked, choices, choices[0], self.acceptance)
        found = search(
            starts(),
            is_settled,
            has_rival=first > self.acceptance.acceptable,
            improve=partial(keep_features, least=self.acceptance.poor_jacobian),
        )
        if not is_resumed and can_be_better(found, self.acceptance):
            state = replace(state, ranked=self.proposals.with_late(state.surface, ranked))
            drawn = drawn_to_compare(state.ranked)
            if drawn is not None:
                found = compare(found, begin(drawn))
        keep_features(found)
        meet_creases(found, self.creases)
        meet_deviation(found, self.bundle.get("deviation"))
        meet_requests(found)
        if not is_usable(found):
            other_genus = (choose(state, i, self.primitives) for i in spares_of(ranked))
            spares = (self.variants(start, stages) for start in other_genus)
            last = last_attempt(chain(in_order(made, found), spares), found.reason)
            if last is not None:
                self._store_meshing(last)
                return last
        return self._finish(found, stages, state.ranked)

    def variants(self, start: RunState, stages: Sequence[Stage]) -> Variants:
        """The variants of the bundle on one structure; with blocks they have no short runs.

        The same holds for a drawn structure, which is compared with the first by meshes of equal
        effort. On a coarse structure, no more variants are tried after crossings; the variants of
        an overlay differ in this respect.
        """
        in_full = start.blocks is not None or is_drawn(start)
        trial = None if in_full else self.bundle.get("trial")
        return Variants(
            stages,
            list(variants_of(self.bundle, start)),
            start,
            self.acceptance,
            self.clock,
            self.deadline,
            trial or {},
            gives_up=not is_fine(start),
        )

    def _finish(
        self, found: Variants, stages: Sequence[Stage], ranked: Sequence[Ranked]
    ) -> RunState:
        """Run the last stages, and store the result of each stage of the best run."""
        state, path = found.finish()
        state = replace(state, ranked=ranked)
        self.store_start(state)
        for stage, result in zip(stages, path, strict=True):
            self.results.store(stage.kind, result)
        return state

    def _mesh_in_time(self, state: RunState, stages: list[Stage], is_resumed: bool) -> RunState:
        seconds = self.settings.seconds
        try:
            with self.deadline.running():
                return self.search(state, stages, is_resumed)
        except TimeIsUp:
            return self._best(f"meshing was stopped after {seconds:g} s, the limit given")
        except KeyboardInterrupt:
            return replace(self._best("meshing was interrupted"), interrupted=True)

    def _best(self, why: str) -> RunState:
        """The best valid mesh so far; raises KeyboardInterrupt if there is none."""
        best = self.deadline.best(lambda s: self.acceptance(_hexes(s), s.surface).key)
        if best is None:
            raise KeyboardInterrupt
        stopped = f"{why}; the result is the best valid mesh until then"
        logger.warning("warning: %s", stopped)
        self._store_meshing(best)
        return replace(best, stopped=stopped)

    def _store_meshing(self, state: RunState) -> None:
        """Store the results of the meshing stages; the hexes for a stage without a result."""
        self.store_start(state)
        for stage in self.meshing:
            value = getattr(state, KINDS[stage.kind].gives)
            self.results.store(stage.kind, state.hexes if value is None else value)

    def check_places(self, hexes: HexMesh, exports: Sequence[Export] = ()) -> None:
        """Raise InputError if the mesh lacks a place that an analysis or an export needs."""
        folder = self.results.folder
        advice = f"; the mesh is saved, continue with resume={folder} from=spline" if folder else ""
        for stage in self.solving:
            try:
                check_names(getattr(stage.plugin, "places", ()), hexes.sets)
            except InputError as error:
                raise InputError(f"{stage.kind}: {error}{advice}") from None
        for export in exports:
            check_names(getattr(export, "places", ()), hexes.sets)


def _hexes(state: RunState) -> HexMesh:
    if state.hexes is None:
        raise MeshingError("there is no hex mesh")
    return state.hexes


def _described(state: RunState) -> str:
    if state.blocks is not None:
        return f"{len(state.blocks.hexes)} blocks"
    assert state.polycube is not None
    return describe(state.polycube)
