"""A run that starts with a hex mesh of another program: `infer.py hex=mesh.vtu`.

There is no proposal and no subdivision. The surface is the one given in addition, or the boundary
of the mesh. The result is never worse than the input.
"""

import logging
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from polycube.errors import InputError
from polycube.io.hex_meshes import boundary, check_place, read_hexes
from polycube.io.surfaces import read_surface
from polycube.kinds import Expected
from polycube.pipeline.resume.results import has_stage
from polycube.pipeline.run import Run
from polycube.pipeline.settings import Node, Settings
from polycube.search.history import History, Move
from polycube.search.loop import search
from polycube.search.moves import Given, MeshStructure
from polycube.stages import Clock, Stage
from polycube.state import RunState
from polycube.surface.measures import genus

logger = logging.getLogger(__name__)

GIVEN = "given"  # stage file of the mesh that was read


class Improvement(Run):
    """A run that starts with hexes."""

    preparation = ("read",)

    @property
    def bundle(self) -> Node:
        """The stages of conf/meshing/improve.yaml."""
        return self.settings.improve

    @property
    def start_fields(self) -> tuple[str, ...]:
        """A surface and a hex mesh."""
        return ("surface", "hexes")

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
        ended = search(history, Policy(len(history.task.variants(None))))
        if history.leader is history.outcomes[0]:
            logger.info("no better mesh was found; the given mesh is the result")
        return self.finish_search(history, stages, ended)


@dataclass(frozen=True)
class Policy:
    """The given mesh, then all variants, one after another."""

    number: int

    def __call__(self, history: History, possible: object) -> Iterator[tuple[Move, Expected]]:
        """The mesh, and the variants of the stages."""
        yield Given(), Expected(0.0, 1.0)
        for variant in range(self.number):
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
