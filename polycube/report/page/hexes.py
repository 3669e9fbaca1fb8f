"""The sections of the hex mesh: measures, worst hexes, distances, counts, and what it loses."""

from collections import Counter
from math import hypot

import numpy as np
from markupsafe import Markup

from polycube.hexmesh.metrics import MEASURES
from polycube.hexmesh.named_sets import kind_of
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.report.numbers.features import KINDS, limit
from polycube.report.numbers.formatting import coordinates
from polycube.report.numbers.sets import model_areas
from polycube.report.numbers.verdict import length_unit
from polycube.report.page import templates
from polycube.report.pictures.colours import CELLS, QUALITY_COLOURS, ramp
from polycube.report.pictures.features import set_colours
from polycube.state import RunState
from polycube.surface.measures import diagonal
from polycube.types import HexMesh, Json

KINDS_OF_SETS = {"direction": "direction", "hole": "hole", "cad_face": "CAD face", "patch": "patch"}
N_BINS = 20  # bars of the histogram: wide enough for touch screens
FLAT = 0.3  # length of the mean normal below which a set has no direction
DIFFERS = 0.1  # of the area of the CAD face: larger differences of its set are shown
N_NAMED = 12  # largest number of grid cells, and of CAD faces, with a name below their picture
N_SHOWN = 10  # rows, the worst first
N_LOST = 60  # lost features in the table, the farthest first


def sets(state: RunState, report: Json, pictures: templates.Pictures) -> Markup:
    """All named sets with colour, size, place and direction, including lost CAD faces."""
    numbers = report.get("hex", {}).get("sets")
    if state.hexes is None or not numbers:
        return templates.NOTHING
    colours, unit = set_colours(state.hexes), length_unit(report)
    members = cad_faces(state.hexes)
    rows: dict[str, templates.Row] = {
        name: {
            "set": templates.Swatch(name, colours.get(name)),
            "kind": KINDS_OF_SETS[own["kind"]],
            **({"CAD faces": members[name]} if members else {}),
            "quads": own["quads"],
            f"area, {unit}²": own["area"],
            "centre": coordinates(own["centroid"], diagonal(state.surface)),
            "mean normal": coordinates(own["normal"]) if hypot(*own["normal"]) > FLAT else None,
            **({"name in the file": own.get("name")} if state.hexes.cad_names else {}),
        }
        for name, own in numbers.items()
    }
    faces = model_areas(state.surface)
    areas = {name: numbers[name]["area"] if name in numbers else 0.0 for name in faces}
    change = {name: areas[name] / area - 1 if area else 0.0 for name, area in faces.items()}
    return templates.render(
        "sets.html",
        picture=pictures.get("sets"),
        main=[row for name, row in rows.items() if name not in faces and kind_of(name) != "patch"],
        faces=[_face(name, rows, change[name]) for name in faces],
        differ=[name for name in faces if abs(change[name]) > DIFFERS],
        limit=f"{100 * DIFFERS:g}",
        patches=[row for name, row in rows.items() if kind_of(name) == "patch"],
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


def _face(name: str, rows: dict[str, templates.Row], change: float) -> templates.Row:
    """The row of a CAD face, compared with its area in the model."""
    empty = {"set": templates.Swatch(name), "kind": KINDS_OF_SETS["cad_face"], "quads": 0}
    own = {title: value for title, value in rows.get(name, empty).items() if title != "CAD faces"}
    return {**own, "of the model's face": f"{1 + change:.1%}"}


def hexes(state: RunState, report: Json, pictures: templates.Pictures) -> Markup:
    """The hex mesh: section, measures, worst hexes, distances from the input, primitives."""
    mesh, numbers = state.hexes, report.get("hex", {})
    if mesh is None:
        return templates.NOTHING
    quality = scaled_jacobian(mesh.vertices, mesh.hexes)
    worst = int(quality.argmin())
    at = coordinates(mesh.vertices[mesh.hexes[worst]].mean(0).tolist())
    return templates.render(
        "hexes.html",
        pictures=pictures,
        unit=length_unit(report),
        diagonal=diagonal(state.surface),
        given=report.get("given"),
        bins=bins_of(quality),
        mesh=mesh,
        quality=quality,
        shares=np.percentile(quality, [1, 5, 50]).tolist(),
        numbers=numbers,
        cad_faces=len(np.unique(state.surface.region)),
        worst_caption=f"Worst hex: number {worst}, at {at}.",
        measures=MEASURES,
        primitives=_primitives(state, mesh),
    )


def bins_of(quality: np.ndarray) -> tuple[list[float], list[int], list[str]]:
    """Edges, counts and colours of the bars of a histogram of scaled Jacobians."""
    low = 0.0 if quality.min() >= 0 else -1.0
    counts, edges = np.histogram(np.clip(quality, low, 1), bins=N_BINS, range=(low, 1))
    colours = ramp((edges[1:] + edges[:-1]) / 2, QUALITY_COLOURS)
    return edges.tolist(), counts.tolist(), [f"#{each.tobytes().hex()}" for each in colours]


def _primitives(state: RunState, mesh: HexMesh) -> Json:
    """Caption and legend of the part divided into the primitives of the grid cells."""
    polycube = state.polycube
    context = polycube.context if polycube is not None else ()
    cells = np.unique(mesh.cell).tolist()
    filled = {c: context[c] if c < len(context) else None for c in cells}
    kinds = Counter(name for name in filled.values() if name)
    counts = ", ".join(f"{n} {name}" for name, n in sorted(kinds.items()))
    named = [(f"{c} {name or ''}".strip(), CELLS[c % len(CELLS)]) for c, name in filled.items()]
    return {
        "caption": f"The part in its {len(cells)} grid cells{f' ({counts})' if counts else ''}, "
        "moved apart; `cell` and `primitive` in hex.vtu.",
        "legend": named if len(cells) <= N_NAMED else (),
    }


def hex_counts(report: Json) -> Markup:
    """Entries of `meshing.at`, unmet ones first, then walls and holes with few hexes."""
    found = report.get("hex", {}).get("counts")
    if not found:
        return templates.NOTHING
    return templates.render("hex_counts.html", found=found, most=N_SHOWN)


def features(report: Json, pictures: templates.Pictures) -> Markup:
    """Points, curves and faces of a CAD model that the hex mesh loses; empty for other parts."""
    found = report.get("hex", {}).get("features")
    if not found:
        return templates.NOTHING
    return templates.render(
        "features.html",
        found=found,
        best=[np.sin(np.radians(each["degrees"])).round(2) for each in found.get("acute", ())],
        most=N_LOST,
        kinds=[f"{kind}s" for kind in KINDS],
        limit=limit(found),
        picture=pictures.get("features"),
        unit=length_unit(report),
    )
