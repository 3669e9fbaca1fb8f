"""The numbers of a run in `report.json`.

Its keys are an interface for other programs; distances are fractions of the diagonal of the
bounding box of the input.
"""

import os
import platform
from collections.abc import Mapping
from dataclasses import asdict
from datetime import datetime

import numpy as np

from polycube import __version__
from polycube.hexmesh.connectivity import extraordinary_edges
from polycube.hexmesh.generation.requests import requests_of
from polycube.hexmesh.generation.requests_met import reached
from polycube.hexmesh.hex_counts import around, through
from polycube.hexmesh.named_sets import cad_sets, kind_of
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.hexmesh.settings import MeshingSettings, edges_around
from polycube.report.numbers import problem, quality, solutions
from polycube.spline.bezier import min_detj
from polycube.spline.boundary import deviation
from polycube.state import RunState
from polycube.structure import lattice
from polycube.structure.projection import project
from polycube.surface import measures
from polycube.types import HexMesh, Json, Polycube, Spline, TriMesh

Numbers = dict[str, object]


def summarize(
    state: RunState,
    seconds: Mapping[str, float],
    effort: Mapping[str, Mapping[str, int]],
    config: Json,
) -> Numbers:
    """Collect the numbers of a run; parts that were not reached are omitted.

    seconds, effort : of the stages, see `polycube.stages.Clock`
    config : the composed settings
    """
    report: Numbers = {"input": _input(state)}
    if state.given is not None:
        report["given"] = {"path": state.hex_path, **quality.short(state.given, state.surface)}
    if state.polycube is not None:
        report["polycube"] = _polycube(state, state.polycube, bool(config["context"]))
    if state.moves:
        moves = [(asdict(move), move.expected._asdict()) for move in state.moves]
        report["search"] = [{**move, "expected": expected} for move, expected in moves]
    if state.hexes is not None:
        context = state.polycube.context if state.polycube else ()
        goal = state.verdict.goal if state.verdict else None
        report["hex"] = {
            **quality.full(state.hexes, state.surface, context, goal),
            "counts": hex_counts(state.hexes, state.surface, config.get("meshing") or {}),
        }
    if state.spline is not None and state.hexes is not None:
        report["spline"] = _spline(state.spline, state.surface, state.hexes)
        if state.solution is not None:
            report |= solutions.numbers(state.spline, state.solution)
            posed = problem.problem_of(config)
            if posed is not None and state.hexes is not None:
                report["problem"] = problem.numbers(posed, state.hexes)
    if state.repair is not None:
        report["repair"] = dict(state.repair)
    if state.points is not None:
        report["points"] = dict(state.points)
    system = f"{platform.system()} {platform.machine()}, {os.cpu_count()} processors"
    return {
        **report,
        **_outcome(state, report),
        "seed": config["seed"],
        "seconds": {stage: round(spent, 3) for stage, spent in seconds.items()},
        "effort": {stage: dict(spent) for stage, spent in effort.items() if spent},
        "version": __version__,
        "made": {
            "date": datetime.now().astimezone().isoformat(timespec="seconds"),
            "machine": f"{platform.node()}: {system}".removeprefix(": "),
        },
    }


def _outcome(state: RunState, report: Numbers) -> Numbers:
    """Whether the result is valid, and the warnings."""
    of_mesh = state.hexes.warnings if state.hexes else ()
    found: Numbers = {"valid": state.failure is None, "warnings": [*state.warnings, *of_mesh]}
    if state.failure is not None:
        found["failure"] = state.failure
    if state.unfitted is not None:
        found["partly_fitted"] = True
    if state.stopped is not None:
        found["stopped"] = state.stopped
    if state.interrupted:
        found["interrupted"] = True
    if state.verdict is not None:
        of_spline = quality.spline_warnings(report.get("spline"))
        found["mesh_warnings"] = [*state.verdict.warnings, *of_spline]
    return found


def _input(state: RunState) -> Numbers:
    surface = state.surface
    return {
        "path": state.path,
        "unit": surface.unit or None,
        "name": surface.name or None,
        "vertices": len(surface.vertices),
        "faces": len(surface.faces),
        "genus": measures.genus(surface),
        "bbox": [surface.vertices.min(0).tolist(), surface.vertices.max(0).tolist()],
        "volume": measures.volume(surface),
        **({"removed": dict(surface.removed)} if surface.removed else {}),
    }


def hex_counts(mesh: HexMesh, surface: TriMesh, meshing: Json) -> dict[str, object]:
    """Count hexes at the entries of `meshing.at`, through all walls and around all holes.

    mesh : hex mesh with the sets of its boundary
    meshing : settings: `at`, `across_wall`, `around_hole`

    The keys of the result:

    at : for each entry the set, the kind of number, the wanted and the reached value, and whether
        it is met; a size in model units; `reached` is None if no quad is on the face
    walls, holes : number of counted ones; walls are CAD faces or, without these, patches
    fewer : for those with fewer hexes than `across_wall` and `around_hole` the same numbers as for
        the entries, in ascending ratio to the wanted number
    """
    requests = requests_of(meshing.get("at") or ())
    at = [
        {
            "at": request.at,
            "kind": request.kind,
            "wanted": request.wanted(surface),
            "reached": has,
            "met": request.is_met(surface, has),
        }
        for request, has in zip(requests, reached(mesh, surface, requests), strict=True)
    ]
    count = through(mesh)[0]
    faces = [name for name in cad_sets(surface).alone.values() if name in mesh.sets]
    faces = faces or [name for name in mesh.sets if kind_of(name) == "patch"]
    walls = {name: float(np.median(count[mesh.sets[name]])) for name in faces}
    holes = {n: float(around(mesh, q)) for n, q in mesh.sets.items() if kind_of(n) == "hole"}
    fewer: list[Json] = []
    for kind, setting, found in (
        ("through", "across_wall", walls),
        ("around", "around_hole", holes),
    ):
        least = edges_around(meshing.get(setting, getattr(MeshingSettings, setting)))
        few = {name: has for name, has in found.items() if has < least}
        fewer += [{"at": n, "kind": kind, "wanted": least, "reached": few[n]} for n in few]
    fewer.sort(key=lambda row: row["reached"] / row["wanted"])
    return {"at": at, "walls": len(walls), "holes": len(holes), "fewer": fewer}


def _polycube(state: RunState, polycube: Polycube, is_given: bool) -> Numbers:
    numbers: Numbers = {
        "grid": list(polycube.grid),
        "context": list(polycube.context),
        "cells": sum(name is not None for name in polycube.context),
        "boxes": int(polycube.occupancy.sum()),
        "genus": lattice.genus(polycube),
        "auto": not is_given,
        "chosen": state.chosen,
        "candidates": [
            {
                "proposal": entry.candidate.proposal,
                "context": list(entry.candidate.polycube.context),
                "key": entry.candidate.key,
                "cost": entry.candidate.cost,
                "probability": entry.candidate.probability,
                "score": entry.score,
                **entry.numbers,
            }
            for entry in state.ranked
        ],
    }
    if state.trajectory is not None:
        last = state.trajectory[-1]
        moved = np.linalg.norm(project(polycube, last)[0] - last, axis=1)
        numbers["denoised_to_polycube_mean"] = float(moved.mean())
        numbers["denoised_to_polycube_max"] = float(moved.max())
        numbers["denoised_lies_on"] = list((state.denoised_on or polycube).context)
    return numbers


def _spline(spline: Spline, surface: TriMesh, hexes: HexMesh) -> Numbers:
    jacobian, distances = min_detj(spline), deviation(spline, surface)
    corners = hexes.hexes[spline.element_hex[[jacobian.scaled_element]]]
    apart = np.linalg.norm(hexes.vertices[corners[0]] - jacobian.scaled_position, axis=1)
    meeting = np.concatenate(extraordinary_edges(hexes)) == corners[0, apart.argmin()]
    return {
        "functions": len(spline.control),
        "elements": len(spline.nodes),
        "extraordinary_edges": spline.extraordinary_edges,
        "min_detj": jacobian.min_detj,
        "min_detj_bound": jacobian.lower_bound,
        "min_scaled_detj": jacobian.min_scaled_detj,
        "min_scaled_detj_at": list(jacobian.scaled_position),
        "min_scaled_detj_hex": float(scaled_jacobian(hexes.vertices, corners)[0]),  # its own
        "min_scaled_detj_edges": int(meeting.sum()),  # extraordinary ones at the nearest corner
        "min_detj_at": list(jacobian.position),
        "min_detj_element": jacobian.element,
        "is_positive": jacobian.lower_bound > 0,
        "volume": jacobian.volume,
        "volume_error": distances.volume,
        **quality.distances("spline_to_surface", distances.to_surface),
        **quality.distances("surface_to_spline", distances.to_spline),
        "farthest_at": list(distances.worst),
    }
