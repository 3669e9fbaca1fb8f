"""The sections of the 3D view and of the structure.

The hex mesh and the solution have separate modules: `hexes` and `solutions`; templates make the
other sections from `report.json` alone. Each section takes the state, the numbers of `report.json`
and the pictures, which may all be incomplete, and returns "" if it is empty.
"""

from markupsafe import Markup

from polycube.report.numbers.verdict import length_unit
from polycube.report.page.templates import NOTHING, Pictures, element
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


def view(state: RunState, report: Json) -> Markup:
    """The hex mesh in three dimensions, directly below the verdict."""
    if state.hexes is None:
        return NOTHING
    context = state.polycube.context if state.polycube is not None else ()
    spline, solution, unit = state.spline, state.solution, length_unit(report)
    solved = None if spline is None or solution is None else (spline, solution)
    goal = state.verdict.goal if state.verdict else Goal()
    shown = viewer(state.hexes, state.surface, context, unit=unit, solved=solved, goal=goal)
    return element(TEMPLATE, "view", shown)


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
