"""The section of the named sets: a picture, and a table that is its legend."""

import numpy as np
from markupsafe import Markup

from polycube.report.numbers.sets import model_areas
from polycube.report.numbers.verdict import length_unit
from polycube.report.page.templates import NOTHING, Pictures, Row, Swatch, point, render
from polycube.report.pictures.features import set_colours
from polycube.state import RunState
from polycube.surface.measures import diagonal
from polycube.types import HexMesh, Json

KINDS = {"direction": "direction", "hole": "hole", "cad_face": "CAD face", "patch": "patch"}
FLAT = 0.3  # length of the mean normal below which a set has no direction
DIFFERS = 0.1  # of the area of the CAD face: larger differences of its set are shown


def sets(state: RunState, report: Json, pictures: Pictures) -> Markup:
    """All named sets with colour, size, place and direction, including lost CAD faces."""
    numbers = report.get("hex", {}).get("sets")
    if state.hexes is None or not numbers:
        return NOTHING
    colours, unit = set_colours(state.hexes), length_unit(report)
    members = cad_faces(state.hexes)
    digits = 4 - int(np.log10(diagonal(state.surface)))
    rows: dict[str, Row] = {
        name: {
            "set": Swatch(name, colours.get(name)),
            "kind": KINDS[own["kind"]],
            **({"CAD faces": members[name]} if members else {}),
            "quads": own["quads"],
            f"area, {unit}²": own["area"],
            "centre": point(own["centroid"], digits),
            "mean normal": _direction(own["normal"]),
            **({"name in the file": own.get("name")} if state.hexes.cad_names else {}),
        }
        for name, own in numbers.items()
    }
    faces = model_areas(state.surface)
    areas = {name: numbers[name]["area"] if name in numbers else 0.0 for name in faces}
    change = {name: areas[name] / area - 1 if area else 0.0 for name, area in faces.items()}
    return render(
        "sets.html",
        picture=pictures.get("sets"),
        main=[row for name, row in rows.items() if name not in faces and not _is_patch(name)],
        faces=[_face(name, rows, change[name]) for name in faces],
        differ=[name for name in faces if abs(change[name]) > DIFFERS],
        limit=f"{100 * DIFFERS:g}",
        patches=[row for name, row in rows.items() if _is_patch(name)],
    )


def cad_faces(mesh: HexMesh) -> dict[str, str]:
    """The numbers of the CAD faces in which each set lies; empty for other parts."""
    number = mesh.cad_face
    if not len(number):
        return {}
    return {name: _ranges(np.unique(number[own])) for name, own in mesh.sets.items()}


def _ranges(numbers: np.ndarray) -> str:
    """1 to 3, 7; a quad of no CAD face has the number 0."""
    numbers = numbers[numbers > 0]
    runs = np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1)
    return ", ".join(
        f"{run[0]} to {run[-1]}" if len(run) > 2 else ", ".join(map(str, run)) for run in runs
    )


def _is_patch(name: str) -> bool:
    return name.startswith("patch_")


def _face(name: str, rows: dict[str, Row], change: float) -> Row:
    """The row of a CAD face, compared with its area in the model."""
    row = rows.get(name, {"set": Swatch(name), "kind": KINDS["cad_face"], "quads": 0})
    own = {title: value for title, value in row.items() if title != "CAD faces"}
    return {**own, "of the model's face": f"{1 + change:.1%}"}


def _direction(normal: list[float]) -> str | None:
    """The mean normal; None if the set has no direction."""
    length = sum(c * c for c in normal) ** 0.5
    return point(normal, 2) if length > FLAT else None
