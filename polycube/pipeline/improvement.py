"""Runs that start with a hex mesh: of another program, or of an identical solid."""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np

from polycube.errors import InputError
from polycube.io.access.reading import read_json
from polycube.io.hex_meshes import boundary, check_place, read_hexes
from polycube.io.solids.motions import Motion
from polycube.io.step.text import STEP
from polycube.io.surfaces import read_surface
from polycube.kinds import Expected
from polycube.pipeline.intake import read_part
from polycube.pipeline.resume.results import StageResults, has_stage
from polycube.pipeline.run import Run
from polycube.pipeline.settings import Settings
from polycube.search.history import History, Move
from polycube.search.loop import search
from polycube.search.moves import Given, MeshStructure
from polycube.stages import Clock, Stage
from polycube.state import RunState
from polycube.surface.measures import genus
from polycube.types import Candidate, HexMesh, Ranked, RoughMap, TriMesh

logger = logging.getLogger(__name__)

GIVEN = "given"  # stage file of the mesh that was read


class Improvement(Run):
    """A run that starts with a hex mesh of another program: `infer.py hex=mesh.vtu`.

    There is no proposal and no subdivision. The surface is the one given in addition, or the
    boundary of the mesh. The result is never worse than the input.
    """

    group = "improve"
    preparation = ("read",)
    starts_from = ("surface", "hexes")

    def load_input(self) -> RunState:
        """The input of the resumed run."""
        given, hex_path = self.results.load(GIVEN)
        return replace(super().load_input(), given=given, hex_path=hex_path, hexes=given)

    def propose(self, state: RunState) -> RunState:
        """The state unchanged: there is no structure."""
        return state

    def store_start(self, state: RunState) -> None:
        """Store the given mesh."""
        self.results.store(GIVEN, [state.given, state.hex_path])

    def search(self, state: RunState, stages: list[Stage], is_resumed: bool) -> RunState:
        """The best mesh of the variants, or the given one if none is better."""
        self.chain.most_crossings = float("inf")  # any improvement is welcome
        history = History(self.task(state, stages))
        ended = search(history, in_order)
        if history.leader is history.outcomes[0]:
            logger.info("no better mesh was found; the given mesh is the result")
        return self.finish_search(history, stages, ended)


def in_order(history: History, possible: object) -> Iterator[tuple[Move, Expected]]:
    """A policy: the given mesh, then all variants of the stages, one after another."""
    yield Given(), Expected(0.0, 1.0)
    for variant in range(len(history.task.variants(None))):
        yield MeshStructure(0, variant), Expected(0.0, 1.0)


def read_given(settings: Settings, clock: Clock) -> RunState:
    """Read the hex mesh of `hex` and the surface of `mesh`; raises InputError."""
    return clock.run("read", lambda: _read_files(settings))


def _read_files(settings: Settings) -> RunState:
    hex_path = str(settings.hex)
    given, warnings = read_hexes(hex_path)
    if settings.mesh is None:
        surface = boundary(given)
    else:
        surface, more = read_surface(settings.mesh, settings.cad, settings.points)
        try:
            check_place(given, surface)
        except InputError as error:
            raise InputError(f"{hex_path} and {settings.mesh}: {error}") from None
        warnings = [*warnings, *more]
        handles = genus(boundary(given)), genus(surface)
        if handles[0] != handles[1]:
            warnings.append("the hex mesh has genus {}, the surface {}".format(*handles))
    start = RunState(surface, settings.mesh or hex_path, tuple(warnings))
    return replace(start, given=given, hex_path=hex_path, hexes=given)


def is_improvement(settings: Settings) -> bool:
    """Whether the run starts with hexes: `hex` is given, or was given in the resumed run."""
    resumed: Path | None = settings.resume
    return settings.hex is not None or (resumed is not None and has_stage(resumed, GIVEN))


class Placement(Run):
    """A run that takes the mesh of an identical solid from its run and moves it to its place.

    The results that depend on the place are computed again: named sets, acceptance, spline,
    analysis.

    settings : settings of this run; those of meshing are from the other run
    source : folder of the other run
    motion : motion from its solid to this one
    """

    def __init__(
        self, settings: Settings, source: Path, motion: Motion, interrupt: Event | None = None
    ) -> None:
        super().__init__(settings, read_part, interrupt)
        loaded = (*self.preparation, *(stage.kind for stage in self.meshing))
        self.results = StageResults(source, loaded, partial(moved, motion=motion))
        self.report = read_json(source / "report.json")

    def load_input(self) -> RunState:
        """The moved surface, with the names that this solid has in a STEP file."""
        state = super().load_input()
        if Path(str(self.settings.mesh)).suffix.lower() not in STEP:
            return state
        own = read_part(self.settings, self.clock).surface
        names = ("name", "region_names", "region_groups", "region_edges", "removed")
        named = {name: getattr(own, name) for name in names}
        return replace(state, surface=replace(state.surface, **named))

    def finish_mesh(self, state: RunState) -> RunState:
        """Name the parts of the boundary and judge the mesh, with the failure of the other run."""
        state = replace(super().finish_mesh(state), stopped=self.report.get("stopped"))
        if not self.report.get("partly_fitted"):
            return state
        failure = self.report["failure"]
        return replace(state, unfitted=failure, failure=failure)


def is_meshed(folder: Path, order: Sequence[str]) -> bool:
    """Whether a run is complete and has stored all of its meshing stages."""
    ended = (folder / "report.json").is_file()
    return ended and all(has_stage(folder, kind) for kind in ("read", "structure", *order))


def moved(value: Any, motion: Motion) -> Any:
    """A stored result with moved coordinates and renumbered CAD faces."""
    if isinstance(value, list | tuple):
        return type(value)(moved(item, motion) for item in value)
    if isinstance(value, TriMesh):
        return _moved_surface(value, motion)
    if isinstance(value, HexMesh):
        return replace(value, vertices=motion(value.vertices), sets={})
    if isinstance(value, RoughMap):
        places = motion(value.positions.reshape(-1, 3)).reshape(value.positions.shape)
        return replace(value, positions=places)
    inner = {Candidate: ("rough_map", "blocks"), Ranked: ("candidate", "hexes")}
    names = inner.get(type(value), ())
    parts: dict[str, Any] = {name: moved(getattr(value, name), motion) for name in names}
    return replace(value, **parts) if parts else value


def _moved_surface(surface: TriMesh, motion: Motion) -> TriMesh:
    order = np.argsort(motion.faces)
    return replace(
        surface,
        vertices=motion(surface.vertices),
        region=motion.faces[surface.region - 1] + 1 if len(surface.region) else surface.region,
        region_names=tuple(surface.region_names[k] for k in order[: len(surface.region_names)]),
        region_shapes=tuple(surface.region_shapes[k] for k in order[: len(surface.region_shapes)]),
    )
