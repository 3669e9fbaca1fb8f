"""The sections of the page: 3D view, input and its changes, structure, denoising, spline, time.

The hex mesh and the solution have separate modules: `hexes` and `solutions`. Each section takes the
state, the numbers of `report.json` and the pictures, which may all be incomplete, and returns "" if
it is empty.
"""

import numpy as np
from markupsafe import Markup

from polycube.report.numbers.verdict import length_unit
from polycube.report.page import charts
from polycube.report.page.templates import NOTHING, Pictures, distance_rows, element, show
from polycube.report.page.views.viewer import viewer
from polycube.report.pictures import scenes
from polycube.report.pictures.colours import AXIS_COLOURS
from polycube.state import RunState
from polycube.structure.lattice import NAMED
from polycube.types import AXES, Goal, Json

N_CANDIDATES = 12  # largest number in the table
STRUCTURE = {  # names of numbers of the structure in report.json, and on the page
    "context": "primitive in each cell of the grid",
    "cells": "cells with a primitive",
    "genus": "holes (genus)",
    "auto": "chosen by the program",
}
INPUT = {  # numbers of the input on the page, and their keys in report.json
    "file": "path",
    "triangles": "faces",
    "vertices": "vertices",
    "holes through the part (genus)": "genus",
}
SPLINE = {  # numbers of the spline on the page, and their keys in report.json
    "functions": "functions",
    "elements": "elements",
    "extraordinary edges": "extraordinary_edges",
    "det J positive everywhere (bound)": "is_positive",
    "smallest det J, over its mean": "min_scaled_detj",
    "place of the smallest det J": "min_detj_at",
    "in element": "min_detj_element",
    "place farthest from the input": "farthest_at",
}


TEMPLATE = "sections.html"


def warnings(report: Json) -> Markup:
    """The warnings about the input and the run."""
    found = report.get("warnings")
    return element(TEMPLATE, "warnings", found) if found else NOTHING


def view(state: RunState, report: Json) -> Markup:
    """The hex mesh in three dimensions, directly below the verdict."""
    if state.hexes is None:
        return NOTHING
    context = state.polycube.context if state.polycube is not None else ()
    spline, solution, unit = state.spline, state.solution, length_unit(report)
    solved = None if spline is None or solution is None else (spline, solution)
    goal = state.verdict.goal if state.verdict else Goal()
    shown = viewer(state.hexes, state.surface, context, unit=unit, solved=solved, goal=goal)
    return element(TEMPLATE, "view", shown) if shown else NOTHING


def surface(state: RunState, report: Json, pictures: Pictures) -> Markup:
    """The input as it was read."""
    numbers = dict(report.get("input", {}))
    box = np.array(numbers.pop("bbox", [[0] * 3] * 2))
    if not numbers:
        return NOTHING
    size = " × ".join(show(float(s)) for s in np.ptp(box, axis=0))
    unit = length_unit(report)
    rows = {title: numbers.get(key) for title, key in INPUT.items()}
    rows[f"volume, {unit}³"] = numbers.get("volume")
    rows[f"size, {unit}"] = size
    rows[f"diagonal, {unit}"] = float(np.linalg.norm(np.ptp(box, axis=0)))
    return element(TEMPLATE, "input", pictures.get("input"), rows)


def structure(state: RunState, report: Json, pictures: Pictures) -> Markup:
    """The polycube, the labels, and the ranking."""
    numbers = dict(_named(report.get("polycube", {})))
    candidates = list(numbers.pop("candidates", ()))
    chosen = numbers.pop("chosen", 0)
    if not numbers and not candidates and not {"polycube", "labels", "proposals"} & set(pictures):
        return NOTHING
    numbers = {STRUCTURE.get(name, name): value for name, value in numbers.items()}
    if "grid" in numbers:
        numbers["grid"] = " × ".join(map(str, numbers["grid"]))
    ranking = [
        {"rank": i + 1, **{k: v for k, v in _named(row).items() if k != "key"}}
        for i, row in enumerate(candidates[: max(N_CANDIDATES, chosen + 1)])
    ]
    title = f"Ranking of {len(candidates)} proposals"
    axes = list(zip(AXES, AXIS_COLOURS, strict=True))
    caption = _proposals_caption(state)
    return element(TEMPLATE, "structure", pictures, axes, numbers, caption, title, ranking, chosen)


def _proposals_caption(state: RunState) -> str:
    """The caption of the sheet of scenes."""
    names = []
    for number, entry in enumerate(scenes.distinct(state.ranked), 1):
        candidate, share = entry.candidate, entry.candidate.probability
        names.append(f"{number} {candidate.proposal}{'' if share is None else f' ({share:.0%})'}")
    return (
        f"The different proposed structures in rows, the best first: {', '.join(names)}. "
        "Probabilities are in brackets; for drawn structures, it is their share of the draws."
    )


def _named(row: Json) -> Json:
    """The row with a short description of the context of a large lattice."""
    context = row.get("context", ())
    if len(context) <= NAMED:
        return row
    n_full = sum(name is not None for name in context)
    return {**row, "context": f"bricks in {n_full} of {len(context)} cells"}


def denoising(report: Json, moving: Pictures) -> Markup:
    """The points of the diffusion model in each recorded state, if it was used."""
    if not moving:
        return NOTHING
    numbers = report.get("polycube", {})
    moved, most = (numbers.get(f"denoised_to_polycube_{which}") for which in ("mean", "max"))
    last = "" if moved is None else f" Their distance from it is {moved:.3f} cells on average"
    last += "" if most is None else f", {most:.3f} at most."
    context, lies_on = (numbers.get(key) for key in ("context", "denoised_lies_on"))
    if lies_on is not None and lies_on != context:
        last += f" They are on another polycube, {', '.join(map(str, lies_on))}."
    text = (
        "Points x_T of the input, moved to the polycube (x_0) by the diffusion model. The colour "
        "of a point is that of its place on the polycube, paler on sides that face away." + last
    )
    return element(TEMPLATE, "denoising", moving, text)


def spline(state: RunState, report: Json, pictures: Pictures) -> Markup:
    """The volumetric spline."""
    numbers, picture = report.get("spline", {}), pictures.get("spline")
    if not numbers and not picture:
        return NOTHING
    rows = {name: numbers.get(key) for name, key in SPLINE.items()}
    unit = length_unit(report)
    rows[f"volume, {unit}³"] = numbers.get("volume")
    if "volume_error" in numbers:
        rows["volume error, %"] = 100 * numbers["volume_error"]
    ways = {"spline to input": "spline_to_surface", "input to spline": "surface_to_spline"}
    diagonal = report.get("hex", {}).get("deviation", {}).get("diagonal")
    return element(TEMPLATE, "spline", picture, rows, distance_rows(numbers, ways, diagonal), unit)


def search(report: Json) -> Markup:
    """How the mesh was found: what the search tried, and where the time went."""
    spent, moves = report.get("seconds"), report.get("search", ())
    rows = [
        {
            "move": row["name"],
            "expected gain": row["expected"]["gain"],
            "gain": row["gain"],
            "expected work": row["expected"]["work"],
            "work": row["work"],
            "seconds": round(row["seconds"], 1),
            "hexes": row["hexes"] or None,
            "result": row["result"],
        }
        for row in moves
    ]
    if not spent and not rows:
        return NOTHING
    gains = [number for number, row in enumerate(moves) if row["gain"] > 0 and row["hexes"]]
    return element(TEMPLATE, "search", rows, gains[-1] if gains else None, charts.bars(spent or {}))


def repairs(report: Json) -> Markup:
    """The changes in order, and the displacement of the surface; empty if there are none."""
    numbers = report.get("repair")
    if not numbers:
        return NOTHING
    before, after = numbers["volume_before"], numbers["volume_after"]
    rows = {
        "level": numbers["level"],
        f"largest deviation, {length_unit(report)}": numbers["deviation"],
        "of the diagonal, %": numbers["deviation_percent"],
        "of new faces from the input": numbers["added"],
        "of the input from new faces": numbers["lost"],
        "volume before": before,
        "volume after": after,
        "volume change, %": 100 * (after / before - 1) if before else None,
        "cells of the rebuilt surface": numbers["cell"],
    }
    return element("repairs.html", "repair", numbers["changes"], rows)


def reconstruction(report: Json) -> Markup:
    """How the surface was made of a point cloud; empty where the input was a surface."""
    numbers = report.get("points")
    if not numbers:
        return NOTHING
    normals = numbers["neighbours"]
    rows = {
        "points": numbers["given"],
        "not finite or duplicates": numbers["dropped"],
        "outliers removed": numbers["outliers"],
        f"spacing, {length_unit(report)}": numbers["spacing"],
        "normals": "those of the file" if normals is None else f"from {normals} neighbours",
        "normals that agree with the surface, %": 100 * numbers["normals_agree"],
        "cells of the reconstruction": numbers["cell"],
        "mean distance of the points from the surface": numbers["deviation_mean"],
        "of 95 % of the points at most": numbers["deviation_p95"],
        "largest": numbers["deviation_max"],
        "largest, % of the diagonal": numbers["deviation_max_percent"],
        "of the surface from the points, largest": numbers["farthest"],
        "area without points, %": 100 * numbers["made_up"],
        "points added there": numbers["added"],
    }
    return element("repairs.html", "points", rows)
