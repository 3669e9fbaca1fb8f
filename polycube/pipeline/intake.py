"""The surface of a run: read, and repaired where that is asked for."""

from __future__ import annotations

from pathlib import Path

from polycube.errors import InputError
from polycube.io.stl import write_stl
from polycube.io.surfaces import read_repaired
from polycube.io.vtk import write_named_vtp
from polycube.pipeline.settings import Settings
from polycube.pipeline.stages import Clock
from polycube.pipeline.state import RunState


def read_part(settings: Settings, clock: Clock) -> RunState:
    """Read the surface of `mesh`; raises InputError."""
    if settings.mesh is None:
        raise InputError("no surface given: say mesh=part.stl, or mesh=example:rod to try it")
    path = settings.mesh
    surface, warnings, repair = clock.run(
        "read", lambda: read_repaired(path, settings.cad, settings.repair)
    )
    numbers = repair.numbers() if repair else None
    return RunState(surface, path=path, warnings=tuple(warnings), repair=numbers)


def write_repaired(folder: Path, state: RunState) -> None:
    """Write the surface as it was repaired, where it was."""
    if state.repair is not None:
        surface = state.surface
        write_stl(folder / "repaired.stl", surface.vertices, surface.faces)
        write_named_vtp(
            folder / "repaired.vtp", surface.vertices, {"surface": surface.faces}, "part"
        )
