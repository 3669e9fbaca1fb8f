"""The stages after meshing: the spline on the hexes, and the analysis on it."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from polycube.analysis.boundary_sets import check_names
from polycube.analysis.preconditioner import is_factored
from polycube.errors import InputError, MeshingError
from polycube.hexmesh.named_sets import sets_of_spline
from polycube.kinds import Export
from polycube.numerics import memory
from polycube.pipeline.resume.results import StageResults
from polycube.pipeline.settings import Settings
from polycube.registry import provide
from polycube.stages import Clock, Stage, build_stages
from polycube.state import RunState
from polycube.types import HexMesh, Solution, Spline


def solving_stages(settings: Settings) -> list[Stage]:
    """The stages after meshing that are requested."""
    wanted = [kind for kind in ("spline", "analysis") if kind in settings.order]
    return build_stages(wanted, settings.composed)


def solved(
    state: RunState, stages: Sequence[Stage], clock: Clock, results: StageResults
) -> RunState:
    """The state after the stages; results of an earlier run are loaded, all are stored.

    A spline may be chosen by the solution on it, which is then not computed again.
    """

    def solve(spline: Spline) -> Solution:
        return clock.run("analysis", partial(stages[-1].plugin, spline))

    for stage in stages:
        if results.is_loaded(stage.kind):
            value = results.load(stage.kind)
        elif stage.kind == "analysis" and state.solution is not None:
            value = state.solution
        else:
            if stage.kind == "analysis" and state.spline is not None:
                memory.warn(len(state.spline.control), is_factored(state.spline))
            if stage.kind == "spline" and stages[-1].kind == "analysis":
                stage = replace(stage, plugin=provide(stage.plugin, analysis=solve))
            value = clock.run(stage.kind, partial(stage, state))
        if isinstance(value, tuple):
            value, solution = value
            state = replace(state, solution=solution)
        state = stage.put(state, value)
        if stage.kind == "spline" and state.spline is not None:
            sets = sets_of_spline(state.spline, hexes_of(state))
            state = replace(state, spline=replace(state.spline, sets=sets))
            value = state.spline
        results.store(stage.kind, value)
    return state


def check_places(
    hexes: HexMesh, stages: Sequence[Stage], exports: Sequence[Export], folder: Path | None = None
) -> None:
    """Raise InputError if the mesh lacks a place that an analysis or an export needs.

    folder : folder of the run, where it can be continued
    """
    advice = f"; the mesh is saved, continue with resume={folder} from=spline" if folder else ""
    for stage in stages:
        try:
            check_names(getattr(stage.plugin, "places", ()), hexes.sets)
        except InputError as error:
            raise InputError(f"{stage.kind}: {error}{advice}") from None
    for export in exports:
        check_names(getattr(export, "places", ()), hexes.sets)


def hexes_of(state: RunState) -> HexMesh:
    """The hexes of a state; raises MeshingError if there are none."""
    if state.hexes is None:
        raise MeshingError("there is no hex mesh")
    return state.hexes
