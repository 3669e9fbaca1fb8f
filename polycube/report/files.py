"""The files of a run: meshes, spline, solution, `report.json` and the HTML page."""

import json
import logging
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np

from polycube.hexmesh.inspection import inspect
from polycube.io import bezier, manifest, vtk
from polycube.io.bext import write_bext, write_bext2
from polycube.io.lsdyna_deck import write_modal_deck
from polycube.io.stl import write_stl
from polycube.kinds import Export
from polycube.pipeline.resume.results import stage_name
from polycube.pipeline.settings import Settings
from polycube.registry import provide
from polycube.report.numbers import quality
from polycube.spline.bezier import scaled_bounds
from polycube.state import RunState
from polycube.types import HexMesh, Polycube, Spline, TriMesh

logger = logging.getLogger(__name__)

REPAIRED = ("repaired.stl", "repaired.vtp")  # written before the results
ALWAYS = ("config.json", "report.json", "polycube.vtu", "trajectory.npz")
OF_PHASE = {  # files written by each phase of a run
    "meshing": ("labels.vtp", "hex.vtu"),
    "spline": ("spline.bext", "spline.bxt", "spline.vtu", "spline.npz", "modal.k"),
    "analysis": ("modes.vtu", "modes.csv", "static.vtu", "poisson.vtu"),
    "report": ("report.html", "trajectory.png"),
}
ARRAYS = ("control", "nodes", "element_hex", "level", "sides", "patch")  # in spline.npz
CSR = ("data", "indices", "indptr")  # arrays of the extraction matrix in it


def check_folder(
    folder: Path, settings: Settings, stages: Sequence[str], exports: Sequence[Export]
) -> None:
    """Check before any work that the run can write its files without overwriting other files.

    Raises InputError with the first file that would be overwritten, or the reason why nothing can
    be written.

    stages : names of all stages with stored results
    """
    names = ["run.log", *ALWAYS, *(stage_name(kind) for kind in (*stages, "given"))]
    names += REPAIRED if settings.repair != "off" else ()
    for phase in settings.order:
        names += OF_PHASE[phase]
    names += [f"hex{export.suffix}" for export in exports]
    manifest.check(folder, names, inputs(settings))


def start_folder(folder: Path, settings: Settings, state: RunState) -> None:
    """Make the folder, remove the results of an earlier run, and write the repaired surface."""
    if not settings.resume:
        clear_results(folder, settings)
    with manifest.writing(folder) as scratch:
        if state.repair is not None:
            corners, faces = state.surface.vertices, state.surface.faces
            write_stl(scratch / "repaired.stl", corners, faces)
            vtk.write_named_vtp(scratch / "repaired.vtp", corners, {"surface": faces}, "part")


def inputs(settings: Settings) -> list[Path]:
    """All files given by options."""
    return [Path(text) for text in strings(settings.composed) if os.path.isfile(text)]


def strings(value: object) -> Iterator[str]:
    """All texts in nested settings."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping):
        yield from chain.from_iterable(strings(item) for item in value.values())
    elif isinstance(value, list | tuple):
        yield from chain.from_iterable(strings(item) for item in value)


def clear_results(folder: Path, settings: Settings, keeps_stages: bool = False) -> None:
    """Remove the unchanged results of an earlier run, so that the folder has only one run.

    keeps_stages : keep the results of its stages, and the repaired surface
    """
    excluded = ("stages/", *REPAIRED) if keeps_stages else ()
    known = ("hex.", "stages/", *REPAIRED, *ALWAYS, *chain.from_iterable(OF_PHASE.values()))
    names = [name for name in manifest.files(folder) if name.startswith(known)]
    manifest.remove(folder, [n for n in names if not n.startswith(excluded)], inputs(settings))


def write_results(
    folder: Path,
    state: RunState,
    report: Mapping[str, object],
    exports: Sequence[Export],
    settings: Settings,
) -> None:
    """Write all files of the run; `report.json` is the last one before the page.

    A mesh that is inverted or crosses itself is not exported for solvers, which cannot see that it
    is invalid.
    """
    clear_results(folder, settings, keeps_stages=True)
    with manifest.writing(folder) as scratch:
        _write_state(scratch, state, settings)
        _write_json(scratch / "config.json", settings.composed)
    if state.hexes is not None and inspect(state.hexes, state.surface).is_sound:
        with manifest.writing(folder) as scratch:
            context = state.polycube.context if state.polycube else ()
            named = replace(state.hexes, primitives=context)
            for export in exports:
                provide(export, spline=state.spline)(named, scratch / "hex")
    with manifest.writing(folder) as scratch:
        _write_json(scratch / "report.json", report)
    if "report" in settings.order:
        from polycube.report.page.html import write_report

        logger.debug("report begins", extra={"stage": "report"})
        write_report(folder, state, {**report, "config": settings.composed}, not state.interrupted)


def write_hexes(path: Path, hexes: HexMesh, surface: TriMesh, polycube: Polycube | None) -> Path:
    """Write the hex mesh with measures, sets, primitives and distances from the surface."""
    off = {"off_surface": quality.off_surface(hexes, surface)}
    return vtk.write_hex_vtu(path, hexes, polycube.context if polycube else (), off)


def _write_state(folder: Path, state: RunState, settings: Settings) -> None:
    if state.polycube is not None:
        vtk.write_polycube_vtu(folder / "polycube.vtu", state.polycube)
    if state.labels is not None:
        vtk.write_labels_vtp(folder / "labels.vtp", state.surface, state.labels)
    if state.hexes is not None:
        write_hexes(folder / "hex.vtu", state.hexes, state.surface, state.polycube)
    if state.spline is not None:
        _write_spline(folder, state, state.spline, settings)
    if state.trajectory is not None:
        states, steps = state.trajectory, np.array(state.steps)
        np.savez_compressed(folder / "trajectory.npz", states=states, steps=steps)


def _write_spline(folder: Path, state: RunState, spline: Spline, settings: Settings) -> None:
    n_elements = len(spline.nodes)
    versions = settings.files.bext_versions(n_elements)
    if 1 in versions:
        write_bext(folder / "spline.bext", spline)
    if 2 in versions:
        write_bext2(folder / "spline.bxt", spline)
    included = "spline.bext" if 1 in versions else "spline.bxt"
    write_modal_deck(folder / "modal.k", included, settings.analysis, state.surface.unit)
    bounds = {"scaled_det_j": scaled_bounds(spline)}
    bezier.write_bezier_vtu(folder / "spline.vtu", spline, cell_data=bounds)
    matrix = {f"extraction_{n}": getattr(spline.extraction, n) for n in CSR}
    arrays = {name: getattr(spline, name) for name in ARRAYS}
    np.savez_compressed(folder / "spline.npz", **arrays, **matrix)
    if state.solution is not None:
        is_curved = settings.files.has_curved_cells(n_elements)
        bezier.write_solution(folder, spline, state.solution, is_curved, settings.files.precision)


def _write_json(path: Path, value: Mapping[str, object]) -> None:
    path.write_text(json.dumps(value, indent=1), encoding="utf-8")
