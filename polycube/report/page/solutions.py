"""The sections of the problem and of its solution: modes, static deformation, potential."""

from markupsafe import Markup

from polycube.report.page.templates import NOTHING, Pictures, element
from polycube.report.pictures.colours import HELD, LOADED
from polycube.report.pictures.fields import exaggeration, first_elastic
from polycube.types import Deformation, Json, Modes, Potential, Solution, Spline

TEMPLATE = "solutions.html"


def problem(report: Json, pictures: Pictures) -> Markup:
    """Material, supports and loads as text and as a picture; empty if they are not known."""
    found = report.get("problem")
    if not found:
        return NOTHING
    colours = {"held": HELD * bool(found["supports"]), "loaded": LOADED * bool(found["loads"])}
    legend = [(name, colour) for name, colour in colours.items() if colour]
    return element(TEMPLATE, "problem", pictures.get("problem"), found, legend)


def solution(
    spline: Spline | None, found: Solution | None, report: Json, pictures: Pictures
) -> Markup:
    """The section of the solution; empty if there is none."""
    if isinstance(found, Modes):
        first = first_elastic(found) if found.rigid else 0
        return element(TEMPLATE, "modes", pictures, found, dict(found.units), first)
    if isinstance(found, Deformation) and spline is not None:
        largest = report["static"]["max_displacement"]
        times = exaggeration(spline.extraction @ spline.control, largest)
        return element(TEMPLATE, "static", pictures, float(f"{times:.3g}"), report)
    if isinstance(found, Potential):
        return element(TEMPLATE, "poisson", pictures, report["poisson"])
    return NOTHING
