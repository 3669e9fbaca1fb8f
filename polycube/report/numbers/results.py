"""The files of a run: numbers in `report.json`, meshes, spline, solution, and the page for people.

Keys of `report.json` are a contract with other programs; distances there are fractions of the
bounding-box diagonal of the input.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from polycube import __version__
from polycube.io.atomic import atomic_write
from polycube.report.numbers import quality as hex_quality
from polycube.report.numbers import solutions
from polycube.structure import lattice
from polycube.surface import measures as topology
from polycube.types import Candidate, HexMesh

logger = logging.getLogger(__name__)

State = Mapping[str, object]

REPAIRED = ("repaired.stl", "repaired.vtp")  # written before the results
ARRAYS = ("control", "nodes", "element_hex", "level", "sides", "patch")  # in spline.npz
CSR = ("data", "indices", "indptr")  # of the extraction matrix, there


def summarize(
    state: State,
    seconds: Mapping[str, float],
    effort: Mapping[str, Mapping[str, int]],
    cfg: Mapping[str, object],
) -> dict[str, object]:
    """Numbers of a run; parts that were not reached are left out.

    seconds, effort : of the stages, see `pipeline.Clock`; stages that descend nothing are left out
    """
    parts = {"input": _input, "given": _given, "polycube": _polycube, "hex": _hex}
    parts |= {"spline": _spline, "repair": lambda state: state["repair"]}
    needs = {"input": "surface", "polycube": "ranked", "hex": "hexes"}
    report = {
        name: numbers(state) for name, numbers in parts.items() if needs.get(name, name) in state
    }
    if "solution" in state:
        report |= solutions.numbers(state["spline"], state["solution"])
    failure = state.get("failure")
    warnings = [*state["warnings"], *getattr(state.get("hexes"), "warnings", ())]
    report |= {"valid": failure is None, "warnings": warnings, "seed": cfg["seed"]}
    if failure is not None:
        report["failure"] = failure
    report |= {name: state[name] for name in ("stopped", "interrupted") if name in state}
    if "hexes" in state:
        report["doubts"] = hex_quality.doubts(state["hexes"], state["surface"], report)
    report["seconds"] = {stage: round(spent, 3) for stage, spent in seconds.items()}
    report["effort"] = {stage: dict(spent) for stage, spent in effort.items() if spent}
    report["version"] = __version__
    return report


def _input(state: State) -> dict[str, object]:
    surface = state["surface"]
    return {
        "path": state["path"],
        "vertices": len(surface.vertices),
        "faces": len(surface.faces),
        "genus": topology.genus(surface),
        "bbox": [surface.vertices.min(0).tolist(), surface.vertices.max(0).tolist()],
        "volume": topology.volume(surface),
    }


def _polycube(state: State) -> dict[str, object]:
    polycube = state["polycube"]
    numbers = {
        "grid": list(polycube.grid),
        "context": list(polycube.context),
        "cells": sum(name is not None for name in polycube.context),
        "boxes": int(polycube.occupancy.sum()),
        "genus": lattice.genus(polycube),
        "auto": state["auto"],
        "chosen": state["chosen"],
        "candidates": [
            {**_name(entry.candidate), "score": entry.score, **entry.numbers}
            for entry in state["ranked"]
        ],
    }
    if state["points"] is not None:
        moved = np.linalg.norm(state["points"] - state["trajectory"][-1], axis=1)
        numbers["denoised_to_polycube_mean"] = float(moved.mean())
        numbers["denoised_to_polycube_max"] = float(moved.max())
        lie_on = state["polycube"] if state["read"] is None else state["read"]
        numbers["denoised_lies_on"] = list(lie_on.context)
    return numbers


def _name(candidate: Candidate) -> dict[str, object]:
    return {
        "proposal": candidate.proposal,
        "context": list(candidate.polycube.context),
        "key": candidate.key,
        "cost": candidate.cost,
        "probability": candidate.probability,
    }


def _hex(state: State) -> dict[str, object]:
    context = state["polycube"].context if "polycube" in state else ()
    return hex_quality.full(state["hexes"], state["surface"], context)


def _given(state: State) -> dict[str, object]:
    numbers = hex_quality.short(state["given"], state["surface"])
    return {"path": state["hex_path"], **numbers}


def _spline(state: State) -> dict[str, object]:
    from polycube.spline.bezier import min_detj
    from polycube.spline.deviation import deviation

    spline = state["spline"]
    jacobian, apart = min_detj(spline), deviation(spline, state["surface"])
    return {
        "functions": len(spline.control),
        "elements": len(spline.nodes),
        "extraordinary_edges": spline.extraordinary_edges,
        "min_detj": jacobian.min_detj,
        "min_detj_bound": jacobian.lower_bound,
        "min_scaled_detj": jacobian.min_scaled_detj,
        "min_detj_at": list(jacobian.position),
        "min_detj_element": jacobian.element,
        "is_positive": jacobian.lower_bound > 0,
        "volume": jacobian.volume,
        "volume_error": apart.volume,
        **hex_quality.distances("spline_to_surface", apart.to_surface),
        **hex_quality.distances("surface_to_spline", apart.to_spline),
        "farthest_at": list(apart.worst),
    }


def clear_results(folder: Path, kept: Collection[str] = ()) -> None:
    """Remove the results of an earlier run, so that a folder tells of one run; its log stays."""
    from polycube.report.page.html import FILES

    for name in {*FILES, "report.html"} - {"run.log", *kept}:
        (folder / name).unlink(missing_ok=True)


def write_results(
    folder: Path,
    state: State,
    report: Mapping[str, object],
    exports: Sequence[Callable[[HexMesh, Path], Path]],
    cfg: Mapping[str, object],
) -> None:
    """Write every file of the run; where `report.json` lies, all but the page lie too."""
    from polycube.io import vtk

    clear_results(folder, REPAIRED)  # where this run was resumed
    if "polycube" in state:
        vtk.write_polycube_vtu(folder / "polycube.vtu", state["polycube"])
    if "labels" in state:
        vtk.write_labels_vtp(folder / "labels.vtp", state["surface"], state["labels"])
    if "hexes" in state:
        context = state["polycube"].context if "polycube" in state else ()
        named = replace(state["hexes"], primitives=tuple(context))
        off = {"off_surface": hex_quality.off_surface(state["hexes"], state["surface"])}
        vtk.write_hex_vtu(folder / "hex.vtu", state["hexes"], context, off)
        for export in exports if report["hex"]["inverted"] == 0 else ():  # solvers see no mark
            export(named, folder / "hex")
    if "spline" in state:
        _write_spline(folder, state, cfg)
    if state.get("trajectory") is not None:
        with atomic_write(folder / "trajectory.npz") as temporary, open(temporary, "wb") as file:
            names = {"states": "trajectory", "steps": "steps", "regular": "points"}
            np.savez_compressed(file, **{name: state[key] for name, key in names.items()})
    _write_json(folder / "config.json", cfg)
    _write_json(folder / "report.json", report)
    if "report" in cfg["order"]:
        from polycube.report.page.html import write_report

        pictured = not report.get("interrupted")  # the one who waits is waiting
        write_report(folder, state, {**report, "config": cfg}, pictured)


def _write_spline(folder: Path, state: State, cfg: Mapping[str, object]) -> None:
    from polycube.io import bext, bext2, bezier
    from polycube.io.lsdyna_deck import settings_of, write_modal_deck
    from polycube.spline.bezier import scaled_bounds

    spline = state["spline"]
    bext.write_bext(folder / "spline.bext", spline)
    bext2.write_bext2(folder / "spline.bxt", spline)
    write_modal_deck(folder / "modal.k", "spline.bext", **settings_of(cfg["analysis"]))
    bounds = {"scaled_det_j": scaled_bounds(spline)}
    bezier.write_bezier_vtu(folder / "spline.vtu", spline, cell_data=bounds)
    with atomic_write(folder / "spline.npz") as temporary, open(temporary, "wb") as file:
        matrix = {f"extraction_{n}": getattr(spline.extraction, n) for n in CSR}
        arrays = {name: getattr(spline, name) for name in ARRAYS}
        np.savez_compressed(file, **arrays, **matrix)
    if "solution" in state:
        bezier.write_solution(folder, spline, state["solution"])


def _write_json(path: Path, value: Mapping[str, object]) -> None:
    with atomic_write(path) as temporary:
        Path(temporary).write_text(json.dumps(value, indent=1), encoding="utf-8")
