"""The sections of the page: 3D view, input and its changes, structure, denoising, spline, time.

The hex mesh and the solution have separate modules: `hexes` and `solutions`. Each section takes the
state, the numbers of `report.json` and the pictures, which may all be incomplete, and returns "" if
it is empty.
"""

import numpy as np
from markupsafe import Markup

from polycube.report.numbers.verdict import length_unit
from polycube.report.page import charts
from polycube.report.page.templates import NOTHING, Pictures, distance_rows, element
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
    numbers = report.get("input", {})
    if not numbers.keys() - {"bbox"}:
        return NOTHING
    sides = np.ptp(numbers.get("bbox", [[0.0] * 3] * 2), axis=0)
    picture, unit = pictures.get("input"), length_unit(report)
    return element(TEMPLATE, "input", picture, numbers, sides.tolist(), unit)


def structure(state: RunState, report: Json, pictures: Pictures) -> Markup:
    """The polycube, the labels, and the ranking."""
    numbers = dict(_named(report.get("polycube", {})))
    candidates = list(numbers.pop("candidates", ()))
    chosen = numbers.pop("chosen", 0)
    shown = {"polycube", "section", "labels", "proposals"}.intersection(pictures)
    if not numbers and not candidates and not shown:
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
    return element(TEMPLATE, "denoising", moving, report.get("polycube", {}))


def spline(state: RunState, report: Json, pictures: Pictures) -> Markup:
    """The volumetric spline."""
    numbers, picture = report.get("spline", {}), pictures.get("spline")
    if not numbers and not picture:
        return NOTHING
    ways = {"spline to input": "spline_to_surface", "input to spline": "surface_to_spline"}
    diagonal = report.get("hex", {}).get("deviation", {}).get("diagonal")
    distances = distance_rows(numbers, ways, diagonal)
    return element(TEMPLATE, "spline", picture, numbers, distances, length_unit(report))


def search(report: Json) -> Markup:
    """How the mesh was found: what the search tried, and where the time went."""
    spent, moves = report.get("seconds"), report.get("search", ())
    if not spent and not moves:
        return NOTHING
    gains = [number for number, row in enumerate(moves) if row["gain"] > 0 and row["hexes"]]
    last = gains[-1] if gains else None
    return element(TEMPLATE, "search", moves, last, charts.bars(spent or {}))


def change(report: Json, name: str) -> Markup:
    """What was done to the input: "repair", or "points" of which the surface was made."""
    numbers = report.get(name)
    return element("repairs.html", name, numbers, length_unit(report)) if numbers else NOTHING
