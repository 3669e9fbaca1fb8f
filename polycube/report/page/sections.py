"""The sections of the 3D view, of the structure, of the problem and of its solution.

Those of the hex mesh have a module of their own, `hexes`; templates make the others from
`report.json` alone. Each section takes what it shows of the state, the numbers of `report.json` and
the pictures, which may all be incomplete, and returns "" if it is empty.
"""

from markupsafe import Markup

from polycube.report.numbers.verdict import length_unit
from polycube.report.page.templates import NOTHING, Pictures, element
from polycube.report.page.views.viewer import viewer
from polycube.report.pictures import scenes
from polycube.report.pictures.colours import AXIS_COLOURS, HELD, LOADED
from polycube.report.pictures.fields import exaggeration, first_elastic
from polycube.state import RunState
from polycube.structure.lattice import NAMED
from polycube.types import AXES, Deformation, Goal, Json, Modes, Potential, Solution, Spline

N_CANDIDATES = 12  # largest number in the table
PICTURES = {"polycube", "section", "labels", "proposals"}  # of the structure
TEMPLATE, SOLUTIONS = "sections.html", "solutions.html"


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


def problem(report: Json, pictures: Pictures) -> Markup:
    """Material, supports and loads as text and as a picture; empty if they are not known."""
    found = report.get("problem")
    if not found:
        return NOTHING
    colours = {"held": HELD * bool(found["supports"]), "loaded": LOADED * bool(found["loads"])}
    legend = [(name, colour) for name, colour in colours.items() if colour]
    return element(SOLUTIONS, "problem", pictures.get("problem"), found, legend)


def solution(
    spline: Spline | None, found: Solution | None, report: Json, pictures: Pictures
) -> Markup:
    """The section of the solution; empty if there is none."""
    if isinstance(found, Modes):
        first = first_elastic(found) if found.rigid else 0
        return element(SOLUTIONS, "modes", pictures, found, dict(found.units), first)
    if isinstance(found, Deformation) and spline is not None:
        largest = report["static"]["max_displacement"]
        times = exaggeration(spline.extraction @ spline.control, largest)
        return element(SOLUTIONS, "static", pictures, float(f"{times:.3g}"), report)
    if isinstance(found, Potential):
        return element(SOLUTIONS, "poisson", pictures, report["poisson"])
    return NOTHING
