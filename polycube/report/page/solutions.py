"""The sections of the problem and of its solution: modes, static deformation, potential."""

from markupsafe import Markup

from polycube.report.numbers import formatting
from polycube.report.page.templates import NOTHING, Pictures, element
from polycube.report.pictures.colours import HELD, LOADED
from polycube.report.pictures.fields import exaggeration, first_elastic
from polycube.state import RunState
from polycube.types import Deformation, Json, Modes, Potential, Spline

TEMPLATE = "solutions.html"
ZERO = 1e-9  # of the largest force: smaller ones are zero but for rounding


def problem(report: Json, pictures: Pictures) -> Markup:
    """Material, supports and loads as text and as a picture; empty if they are not known."""
    found = report.get("problem")
    if not found:
        return NOTHING
    colours = {"held": HELD * bool(found["supports"]), "loaded": LOADED * bool(found["loads"])}
    legend = [(name, colour) for name, colour in colours.items() if colour]
    return element(TEMPLATE, "problem", pictures.get("problem"), found, legend)


def solution(state: RunState, report: Json, pictures: Pictures) -> Markup:
    """The section of the solution; empty if there is none."""
    found = state.solution
    if isinstance(found, Modes):
        return _modes(found, pictures)
    if isinstance(found, Deformation) and state.spline is not None:
        return _static(state.spline, found, report, pictures)
    if isinstance(found, Potential):
        return _poisson(report["poisson"], pictures)
    return NOTHING


def _modes(found: Modes, pictures: Pictures) -> Markup:
    """Frequencies, and animations of the first elastic modes."""
    units = dict(found.units)
    unit = units.get("frequency", "")
    squared = f"angular frequency squared, 1/{units.get('time', 'time')}²"
    first = first_elastic(found) if found.rigid else 0
    errors = dict(enumerate(found.errors, found.rigid))
    heads = ["mode", squared, f"frequency, {unit or 'cycles per unit of time'}"]
    heads += ["estimated error, %", ""]
    rows = list(zip(found.eigenvalues.tolist(), found.frequency.tolist(), strict=True))
    values = [formatting.frequency(value, unit) for value in found.frequency]
    shown = [(pictures.get(f"mode_{i}"), f"Mode {i + 1}: {v}") for i, v in enumerate(values)]
    return element(TEMPLATE, "modes", shown, heads, rows, errors, first, float(found.mass), units)


def _static(spline: Spline, found: Deformation, report: Json, pictures: Pictures) -> Markup:
    """The deformed solid, the largest values with their places, and the reactions."""
    numbers = report["static"]
    times = exaggeration(spline.extraction @ spline.control, numbers["max_displacement"])
    forces = [*numbers["reactions"], {"at": "loads", "force": numbers["load"]}]
    zero = ZERO * max(abs(part) for row in forces for part in row["force"])
    rows = []
    for row in forces:
        parts = [part if abs(part) > zero else 0.0 for part in row["force"]]
        rows.append({"at": row["at"], **dict(zip(("x, N", "y, N", "z, N"), parts, strict=True))})
    phrases = [*formatting.singular_stress(numbers), *formatting.cautions(report)]
    notes = [formatting.sentence(phrase) for phrase in phrases]
    picture, unit = pictures.get("static"), found.units["length"]
    return element(TEMPLATE, "static", picture, float(f"{times:.3g}"), numbers, unit, notes, rows)


def _poisson(numbers: Json, pictures: Pictures) -> Markup:
    """u on the surface, and the flow through each support."""
    return element(TEMPLATE, "poisson", pictures.get("poisson"), numbers)
