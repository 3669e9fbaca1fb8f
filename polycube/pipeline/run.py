"""The steps of a run, in order: from the surface of a part to the solution on its spline."""

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from threading import Event

from polycube.errors import InputError, MeshingError
from polycube.hexmesh.cad_faces import with_sets
from polycube.hexmesh.generation.requests import requests_of
from polycube.hexmesh.generation.requests_met import check_requests
from polycube.kinds import KINDS, Acceptance, Policy
from polycube.pipeline.primitives import voxels
from polycube.pipeline.proposals import Proposals
from polycube.pipeline.resume.results import StageResults
from polycube.pipeline.resume.settings import changed_settings, stored
from polycube.pipeline.settings import Settings
from polycube.pipeline.solving import hexes_of, solved, solving_stages
from polycube.registry import build
from polycube.search.chain import Chain, Deadline, TimeIsUp, check_options
from polycube.search.history import History, Task, choose, judged
from polycube.search.loop import make, moves_of, search
from polycube.search.unfitted import wrong_topology
from polycube.stages import Clock, Stage, meshing_stages
from polycube.state import RunState
from polycube.structure.projection import nearest_labels
from polycube.types import Json
from polycube.units import resolved

logger = logging.getLogger(__name__)

Read = Callable[[Settings, Clock], RunState]


class Run:
    """The steps of a run. All plugins are built and checked at the start.

    Raises InputError if a plugin, an option or the order of the stages is invalid.

    settings : settings of the run
    read : makes the first state: a surface, or a surface with a hex mesh to improve
    interrupt : set by another thread or by a signal handler to end the run
    """

    group = "meshing"  # of the settings, with the meshing stages
    preparation: tuple[str, ...] = ("read", "structure")  # stages before the meshing stages
    # fields of the state from which meshing starts
    starts_from: tuple[str, ...] = ("surface", "polycube", "rough_map", "blocks", "parametrization")

    def __init__(self, settings: Settings, read: Read, interrupt: Event | None = None) -> None:
        self.settings = settings
        self.bundle: Json = getattr(settings, self.group)  # meshing stages and their variants
        self.clock = Clock()
        self.deadline = Deadline(settings.seconds, interrupt or Event())
        self._stored: tuple[int, int] | None = None  # number of structures, and the chosen one
        self._read = read
        try:
            self.requests = requests_of(settings.meshing.get("at") or ())
        except ValueError as error:
            raise InputError(str(error), "meshing.at") from None
        self.policy: Policy = build("policy", settings.policy)
        self.meshing = meshing_stages(self.bundle, self.starts_from)
        check_options(self.meshing, self.bundle)
        self.solving = solving_stages(self.settings)
        self.primitives = voxels(settings.primitives["use"])
        ranking = build("ranking", settings.ranking)
        self.proposals = Proposals(settings, self.primitives, ranking, self.clock)
        self.names = [*self.preparation, *(s.kind for s in (*self.meshing, *self.solving))]
        if settings.resume and settings.start not in self.names:
            what = f"resume needs the first stage to run again, from=STAGE; got {settings.start}"
            raise InputError(f"{what}, have {', '.join(self.names)}")
        loaded = self.names[: self.names.index(str(settings.start))] if settings.resume else ()
        self.results = StageResults(settings.resume, loaded)
        self.acceptance: Acceptance = build("acceptance", settings.acceptance)
        self.chain = Chain(self.clock, self.deadline)
        self.history: History | None = None

    def begin(self) -> RunState:
        """Read the part and propose its first structures.

        Raises InputError if the input is invalid, or if no proposal fits the part. Raises
        MeshingError if the time limit is reached.
        """
        is_loaded = self.results.is_loaded("read")
        state = self.load_input() if is_loaded else self._read(self.settings, self.clock)
        for warning in state.warnings:
            logger.warning("warning: %s", warning)
        self.settings = self.settings.in_unit(state.surface.unit)
        self.solving = solving_stages(self.settings)
        check_requests(state.surface, self.requests)
        return self.propose(state)

    def load_input(self) -> RunState:
        """The input of the resumed run."""
        surface, path, warnings, repair, *rest = self.results.load("read")
        points = rest[0] if rest else None  # older runs stored no points
        return RunState(surface, path=path, warnings=tuple(warnings), repair=repair, points=points)

    def propose(self, state: RunState) -> RunState:
        """Propose and rank structures, tier by tier, until there is one; choose the best."""
        if self.results.is_loaded("structure"):
            ranked, chosen = self.results.load("structure")
            return choose(replace(state, ranked=ranked), chosen, self.primitives)
        task = replace(self.task(state, self.meshing), tiers=self.proposals.tiers)
        self.history = history = History(task)
        try:
            with self.deadline.running():
                for move, expected in moves_of(self.policy, history):
                    make(history, move, expected)
                    if history.ranked:
                        return choose(replace(state, ranked=history.ranked), 0, self.primitives)
        except TimeIsUp:
            raise MeshingError(self._too_late("structure")) from None
        raise InputError(self.proposals.explain_none(state.surface))

    def store_input(self, state: RunState, folder: Path) -> None:
        """Store the input in the results folder; from here on, results are stored there."""
        self.results.folder = folder
        if self.settings.resume:
            remaining = [name for name in self.names if not self.results.is_loaded(name)]
            earlier = stored(self.settings.resume) or self.settings.composed
            for sentence in changed_settings(self.settings.composed, earlier, remaining):
                logger.warning("warning: resumed with other settings: %s", sentence)
        value = [state.surface, state.path, [*state.warnings], state.repair, state.points]
        self.results.store("read", value)
        self.store_start(state)

    def store_start(self, state: RunState) -> None:
        """Store the state from which meshing starts, unless it is stored already."""
        if self._stored != (len(state.ranked), state.chosen):
            self.results.store("structure", [state.ranked, state.chosen])
            self._stored = len(state.ranked), state.chosen

    def mesh(self, state: RunState) -> RunState:
        """Make the hexes; see `polycube.search`.

        At the time limit, or if the user ends the run, the result is the best mesh so far. Raises
        KeyboardInterrupt if the user ended the run before there was a mesh. Raises MeshingError if
        there is no mesh.
        """
        loaded = [stage for stage in self.meshing if self.results.is_loaded(stage.kind)]
        remaining = self.meshing[len(loaded) :]
        for stage in loaded:
            value = self.results.load(stage.kind)
            state = stage.put(state, value)
            self.results.store(stage.kind, value)
        if remaining:
            state = self.search(state, remaining, bool(loaded))
        return self.finish_mesh(state)

    def search(self, state: RunState, stages: list[Stage], is_resumed: bool) -> RunState:
        """Search for the best mesh, and run the last stages on it.

        stages : the meshing stages to run
        is_resumed : whether the state has results of earlier stages on the chosen structure, which
            is then the only one
        """
        history = self.history
        if history is None or state.ranked is not history.ranked:
            only = state.chosen if is_resumed else None
            history = History(self.task(state, stages), [*state.ranked], only=only)
        return self.finish_search(history, stages, search(history, self.policy))

    def task(self, state: RunState, stages: Sequence[Stage]) -> Task:
        """What the search works on: from a state, with the stages before those that run once."""
        kinds = [KINDS[stage.kind] for stage in stages]
        once = next((i for i, kind in enumerate(kinds) if kind.once), len(stages))
        cures = next((i for i, kind in enumerate(kinds) if kind.cures), once)
        fit, cure = stages[:cures], stages[cures:once]
        how = self.bundle, self.acceptance, self.chain, self.proposals
        return Task(state, fit, cure, *how, (), self.primitives)

    def finish_search(self, history: History, stages: list[Stage], ended: str | None) -> RunState:
        """The state of the best mesh after the last stages; the results of stages are stored."""
        leader, limit = history.leader, self.settings.seconds
        if leader is None and ended == "user":
            raise KeyboardInterrupt
        if leader is None:
            raise MeshingError(self._too_late("mesh") if ended else history.why_no_mesh)
        found, results = leader.state, leader.results
        if ended is None and not found.unfitted:
            once = [stage for stage in stages if KINDS[stage.kind].once]
            try:
                found, more = self.chain.run(once, found, {})
                results = {**results, **more}
            except TimeIsUp:
                ended = "time"
            except KeyboardInterrupt:
                ended = "user"
            except MeshingError as error:
                logger.warning("warning: %s; the mesh before is the result", error)
        is_judged = found.hexes is leader.state.hexes and not found.unfitted
        verdict = leader.verdict if is_judged else None
        found = replace(found, ranked=history.ranked, moves=tuple(history.table), verdict=verdict)
        if ended is not None:
            why = "interrupted" if ended == "user" else f"stopped at the time limit of {limit:g} s"
            stopped = f"meshing was {why}; the result is the best mesh until then"
            logger.warning("warning: %s", stopped)
            found = replace(found, stopped=stopped, interrupted=ended == "user")
        self.store_start(found)
        for stage in stages:
            value = results.get(stage.kind, getattr(found, KINDS[stage.kind].gives))
            self.results.store(stage.kind, found.hexes if value is None else value)
        return found

    def _too_late(self, what: str) -> str:
        spent = ", ".join(f"{name} {s:.0f} s" for name, s in self.clock.seconds.items() if s >= 1)
        limit = f"the time limit of {self.settings.seconds:g} s was reached"
        stages = f" ({spent})" if spent else ""
        return f"{limit} before there was a {what}{stages}; give more seconds"

    def finish_mesh(self, state: RunState) -> RunState:
        """Name the parts of the boundary, label the surface, and judge a mesh without a verdict."""
        given, unit = self.settings.analysis.get("units"), state.surface.unit
        unit = resolved(given, unit) if given else unit
        hexes = replace(with_sets(hexes_of(state), state.surface), unit=unit)
        labels = state.labels
        if labels is None and state.polycube is not None and state.parametrization is not None:
            labels = nearest_labels(state.surface, state.polycube, state.parametrization)
        verdict = state.verdict or judged(self.acceptance, hexes, state.surface)
        state = replace(state, hexes=hexes, labels=labels, verdict=verdict)
        failures = [*filter(None, (state.unfitted, wrong_topology(state))), *verdict.failures]
        if not failures and self.settings.strict and verdict.warnings:
            failures = [f"strict=true: {verdict.warnings[0]}"]
        return replace(state, failure="; ".join(failures)) if failures else state

    def solve(self, state: RunState) -> RunState:
        """Build the spline on the hexes and solve the analysis on it, unless the time is over."""
        if self.solving and self.deadline.is_over and not state.stopped:
            left = " and ".join(stage.kind for stage in self.solving)
            advice = f"resume={self.results.folder} from={self.solving[0].kind} computes it"
            stopped = f"the time limit of {self.settings.seconds:g} s is over; {left} left out"
            return replace(state, stopped=f"{stopped}, {advice}")
        return solved(state, self.solving, self.clock, self.results)
