"""A run that takes the mesh of an identical solid and moves it to its place.

The results that depend on the place are computed again: named sets, acceptance, spline, analysis.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np

from polycube.io.access.stored import read_json
from polycube.io.solids.motions import Motion
from polycube.io.step.text import STEP
from polycube.pipeline.intake import read_part
from polycube.pipeline.resume.results import StageResults, has_stage
from polycube.pipeline.run import Run
from polycube.pipeline.settings import Settings
from polycube.state import RunState
from polycube.types import Candidate, HexMesh, Ranked, RoughMap, TriMesh


class Placement(Run):
    """A run that takes everything up to the mesh from another run.

    Parameters
    ----------
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
        names = ("name", "region_names", "region_groups", "region_edges")
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
    """Whether a run is complete and has stored all of its meshing stages.

    order : order of the meshing stages
    """
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
