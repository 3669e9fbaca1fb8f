"""The sections of the hex mesh: view, measures, certificate, worst hexes, distances, primitives."""

from __future__ import annotations

from collections import Counter

import numpy as np

from polycube.hexmesh.metrics import MEASURES
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.pipeline.state import RunState
from polycube.report.page import charts
from polycube.report.page.markup import (
    Pictures,
    distance_table,
    facts,
    figure,
    folded,
    gradient,
    grid,
    section,
    show,
    swatches,
    table,
)
from polycube.report.page.viewer import viewer
from polycube.report.pictures.colours import DEVIATION_COLOURS, QUALITY_COLOURS
from polycube.report.pictures.scenes import cell_colour
from polycube.types import HexMesh, Json, TriMesh

QUALITY_BAR = gradient(QUALITY_COLOURS, "0 scaled Jacobian", "1")
FARTHEST = {
    "place farthest from the input": "mesh_to_surface_max_at",
    "place of the input farthest from the mesh": "surface_to_mesh_max_at",
}
N_NAMED = 12  # largest number of grid cells, and of CAD faces, with a name below their picture


def view(state: RunState) -> str:
    """The hex mesh in three dimensions, directly below the verdict."""
    mesh = state.hexes
    if mesh is None:
        return ""
    polycube = state.polycube
    context = polycube.context if polycube is not None else ()
    return section("view", "3D view", viewer(mesh, state.surface, context))


def hexes(state: RunState, report: Json, pictures: Pictures) -> str:
    """The hex mesh: section, measures, worst hexes, distances from the input, primitives."""
    mesh, numbers = state.hexes, report.get("hex", {})
    if mesh is None:
        return ""
    quality = scaled_jacobian(mesh.vertices, mesh.hexes)
    worst = int(quality.argmin())
    at = ", ".join(f"{c:.4g}" for c in mesh.vertices[mesh.hexes[worst]].mean(0))
    return section(
        "hexes",
        "Hex mesh",
        _improved(report, pictures),
        grid(
            figure(pictures.get("hex"), "Hex mesh, coloured by scaled Jacobian.", QUALITY_BAR),
            ""  # shown beside the given mesh already
            if "given" in report
            else figure(
                pictures.get("cut"), "Cut open: whole hexes behind the plane.", QUALITY_BAR
            ),
        ),
        f"<h3>Scaled Jacobian of {show(len(mesh.hexes))} hexes</h3>",
        "<p class=note>Click on a bar to show its hexes in the view above.</p>",
        charts.histogram(quality),
        grid(
            facts(_rows(mesh, quality, numbers) | _cad_faces(state.surface, numbers)),
            figure(pictures.get("worst"), f"Worst hex: number {worst}, at ({at})."),
        ),
        _measures(numbers),
        _worst(numbers),
        _distances(state, numbers, pictures),
        _primitives(state, mesh, pictures),
    )


def _rows(mesh: HexMesh, quality: np.ndarray, numbers: Json) -> dict[str, object]:
    shares = np.percentile(quality, [1, 5, 50])
    return {
        "hexes": len(mesh.hexes),
        "vertices": len(mesh.vertices),
        "scaled Jacobian, min": float(quality.min()),
        "scaled Jacobian, quantiles of 1 / 5 / 50 %": " / ".join(f"{s:.3f}" for s in shares),
        "scaled Jacobian, mean": float(quality.mean()),
        "inverted (at most 0)": int((quality <= 0).sum()),
        "below 0.2": int((quality < 0.2).sum()),
        "certificate": _certificate(numbers.get("certificate")),
        "sharp edges to mesh edges, 95th percentile, % of diagonal": _times(
            100, numbers.get("creases_to_edges_p95")
        ),
        "volume error, %": _times(100, numbers.get("volume_error")),
    }


def _cad_faces(surface: TriMesh, numbers: Json) -> dict[str, object]:
    """The CAD faces that the mesh lost, if the part is a CAD model."""
    lost, all_faces = numbers.get("faces_without_quads"), len(np.unique(surface.region))
    if lost is None or not all_faces:
        return {}
    names = f": {', '.join(lost[:N_NAMED])}{', ...' * (len(lost) > N_NAMED)}" if lost else ""
    return {"CAD faces without a quad": f"{len(lost)} of {all_faces}{names}"}


def _certificate(found: Json | None) -> str | None:
    """A sentence about the certified sign of the Jacobian."""
    if found is None:
        return None
    if not found["positive_at_corners"]:
        return "none: not positive at all corners"
    if found["positive_everywhere"]:
        return "Jacobian positive everywhere (Bernstein bounds)"
    open_ones = found["not_positive"] + found["undecided"]
    named = ", ".join(map(str, found["not_certified"][:5]))
    more = ", ..." if open_ones > 5 else ""
    return f"positive at all corners and centres; not everywhere in {open_ones}: {named}{more}"


def _measures(numbers: Json) -> str:
    """Other measures of finite-element programs: small histograms and a table."""
    found, shapes = numbers.get("quality"), numbers.get("histograms")
    if not found or not shapes:
        return ""
    rows, small = [], []
    for name, (perfect, bad, meaning) in MEASURES.items():
        values, words = found[name], _words(name)
        worst = values["min" if bad is min else "max"]
        rows.append(
            {
                "measure": words,
                "worst": worst,
                "mean": values["mean"],
                "best": values["max" if bad is min else "min"],
                "cube": perfect,
                "what": meaning,
            }
        )
        if name not in ("scaled_jacobian", "max_edge_ratio"):
            shape = shapes[name]
            text = f"worst {show(worst)}"
            small.append(charts.spread(words, shape["edges"], shape["counts"], text))
    title = "<h3>Other measures, VTK's numbers</h3>"
    told = folded("What they mean, worst, mean and best", table(rows))
    return f'{title}<div class="small">{"".join(small)}</div>{told}'


def _worst(numbers: Json) -> str:
    rows = [
        {
            "worst by": _words(row["worst_by"]),
            "hex": row["hex"],
            **{_words(name): row[name] for name in row if name in MEASURES},
            "middle, model units": ", ".join(f"{c:.4g}" for c in row["center"]),
            "cell": row["cell"],
            **({"primitive": row["primitive"]} if "primitive" in row else {}),
            "on patch": ", ".join(map(str, row["patches"])) or "inside",
        }
        for row in numbers.get("worst", ())
    ]
    return folded("Worst hexes, and where they are", table(rows)) if rows else ""


def _distances(state: RunState, numbers: Json, pictures: Pictures) -> str:
    """Table of distances from the input, in per cent of the diagonal and in model units."""
    found = state.surface
    if found is None or "surface_to_mesh_max" not in numbers:
        return ""
    diagonal = float(np.linalg.norm(np.ptp(found.vertices, axis=0)))
    ways = {"hex mesh to input": "mesh_to_surface", "input to hex mesh": "surface_to_mesh"}
    ways |= {"boundary vertices to input": "vertex_off_surface"}
    rows = distance_table(numbers, ways, diagonal)
    found = numbers.get("deviation", {})
    far = f"{show(found.get('mesh_to_surface_max'))} model units"
    picture = grid(
        figure(
            pictures.get("deviation"),
            "Each boundary quad in the colour of its largest distance from the input.",
            gradient(DEVIATION_COLOURS, "0", far),
        ),
        facts({name: _point(found.get(key)) for name, key in FARTHEST.items()}),
    )
    return f"<h3>Distance between hex mesh and input</h3>{rows}{picture}"


def _primitives(state: RunState, mesh: HexMesh, pictures: Pictures) -> str:
    """The part divided into the primitives of the grid cells."""
    picture = pictures.get("cells")
    if picture is None:
        return ""
    polycube = state.polycube
    context = polycube.context if polycube is not None else ()
    cells = np.unique(mesh.cell).tolist()
    filled = {c: context[c] if c < len(context) else None for c in cells}
    kinds = Counter(name for name in filled.values() if name)
    counts = ", ".join(f"{n} {name}" for name, n in sorted(kinds.items()))
    legend = ""
    if len(cells) <= N_NAMED:
        names = [f"{c} {name or ''}".strip() for c, name in filled.items()]
        legend = swatches(names, [cell_colour(c) for c in cells])
    text = (
        f"The part in its {len(cells)} grid cells{f' ({counts})' if counts else ''}, moved apart; "
        "`cell` and `primitive` in hex.vtu."
    )
    return "<h3>Primitives</h3>" + grid(figure(picture, text, legend))


def _improved(report: Json, pictures: Pictures) -> str:
    """Comparison before and after, if the run started with hexes."""
    given, made = report.get("given"), report.get("hex")
    if not given or not made:
        return ""
    rows = [
        {
            "mesh": name,
            "hexes": numbers["hexes"],
            "scaled Jacobian, min": numbers["min_scaled_jacobian"],
            "mean": numbers["mean_scaled_jacobian"],
            "inverted": numbers["inverted"],
            "input to mesh, 99th percentile, % of diagonal": 100 * numbers["surface_to_mesh_p99"],
            "vertices off, % of diagonal": 100 * numbers["vertex_off_surface_max"],
            "volume error, %": 100 * numbers["volume_error"],
        }
        for name, numbers in {"as given": given, "improved": made}.items()
    ]
    both = grid(
        figure(pictures.get("given"), "The given mesh, cut open.", QUALITY_BAR),
        figure(pictures.get("cut"), "Improved, cut open.", QUALITY_BAR),
    )
    return f"<h3>Before and after</h3>{table(rows)}{both}"


def _point(where: list[float] | None) -> str | None:
    return None if where is None else f"({', '.join(f'{c:.4g}' for c in where)})"


def _words(measure: str) -> str:
    return measure.replace("_", " ").replace("jacobian", "Jacobian")


def _times(factor: float, value: float | None) -> float | None:
    return None if value is None else factor * value
