"""The section of the named sets: a picture, and a table that is its legend."""

from __future__ import annotations

import numpy as np

from polycube.pipeline.state import RunState
from polycube.report.numbers.sets import model_areas
from polycube.report.numbers.verdict import length_unit
from polycube.report.page.markup import (
    Pictures,
    Swatch,
    figure,
    folded,
    grid,
    point,
    section,
    show,
    table,
)
from polycube.report.pictures.named_sets import set_colours
from polycube.surface.measures import diagonal
from polycube.types import Json

KINDS = {"direction": "direction", "hole": "hole", "cad_face": "CAD face", "patch": "patch"}
FLAT = 0.3  # length of the mean normal below which a set has no direction
DIFFERS = 0.1  # of the area of the CAD face: larger differences of its set are shown


def sets(state: RunState, report: Json, pictures: Pictures) -> str:
    """All named sets with colour, size, place and direction, including lost CAD faces."""
    numbers = report.get("hex", {}).get("sets")
    if state.hexes is None or not numbers:
        return ""
    colours, unit = set_colours(state.hexes), length_unit(report)
    digits = 4 - int(np.log10(diagonal(state.surface)))
    rows = {
        name: {
            "set": Swatch(name, colours.get(name)),
            "kind": KINDS[own["kind"]],
            "quads": own["quads"],
            f"area, {unit}²": own["area"],
            "centre": point(own["centroid"], digits),
            "mean normal": _direction(own["normal"]),
        }
        for name, own in numbers.items()
    }
    faces = model_areas(state.surface)
    main = [row for name, row in rows.items() if name not in faces and not _is_patch(name)]
    patches = [row for name, row in rows.items() if _is_patch(name)]
    text = (
        "The named sets of the boundary, from the front above and from behind below; the table is "
        "the legend. A quad in several sets has the colour of the first, grey quads are in none."
    )
    return section(
        "sets",
        "Boundary sets",
        "<p>Supports, loads and exported files name parts of the boundary by these sets.</p>",
        grid(figure(pictures.get("sets"), text)),
        table(main) if main else "",
        _cad_faces(rows, numbers, faces),
        folded(f"{len(patches)} patches of the polycube", table(patches)) if patches else "",
    )


def _is_patch(name: str) -> bool:
    return name.startswith("patch_")


def _cad_faces(rows: Json, numbers: Json, faces: dict[str, float]) -> str:
    """The CAD faces with their areas in the model, and those without a quad."""
    if not faces:
        return ""
    listed, differ = [], []
    for name, area in faces.items():
        own = numbers.get(name, {"quads": 0, "area": 0.0})
        change = own["area"] / area - 1 if area else 0.0
        row = rows.get(name, {"set": Swatch(name), "kind": KINDS["cad_face"], "quads": 0})
        listed.append({**row, "of the model's face": f"{1 + change:.1%}"})
        if abs(change) > DIFFERS:
            differ.append(name)
    note = (
        f"<p class=note>CAD faces whose set has no quad, or an area that differs by more than "
        f"{100 * DIFFERS:g} %: {len(differ)} of {len(faces)} ({show(differ)}).</p>"
        if differ
        else ""
    )
    return note + folded(f"{len(faces)} CAD faces", table(listed))


def _direction(normal: list[float]) -> str | None:
    """The mean normal; None if the set has no direction."""
    length = sum(c * c for c in normal) ** 0.5
    return point(normal, 2) if length > FLAT else None
