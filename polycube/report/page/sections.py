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
PICTURES = {"polycube", "section", "labels", "proposals"}  # of the structure
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
    found, proposed = report.get("polycube", {}), scenes.distinct(state.ranked)
    if not found and PICTURES.isdisjoint(pictures):
        return NOTHING
    axes = list(zip(AXES, AXIS_COLOURS, strict=True))
    return element(TEMPLATE, "structure", pictures, axes, found, proposed, NAMED, N_CANDIDATES)
