"""The sections of the page: input, structure, denoising, spline, time.

The top of the page, the hex mesh and the solution have separate modules: `verdict`, `hexes` and
`solutions`. Each section takes the state, the numbers of `report.json` and the pictures, which may
all be incomplete, and returns "" if it is empty.
"""

from __future__ import annotations

import numpy as np

from polycube.pipeline.state import RunState
from polycube.report.page import charts
from polycube.report.page.markup import (
    Pictures,
    distance_table,
    facts,
    figure,
    folded,
    grid,
    section,
    show,
    swatches,
    table,
)
from polycube.report.pictures import proposals
from polycube.report.pictures.colours import AXIS_COLOURS
from polycube.structure.lattice import NAMED
from polycube.types import AXES, Json

N_CANDIDATES = 12  # largest number in the table
SPLINE = {  # numbers of the spline on the page, and their keys in report.json
    "functions": "functions",
    "elements": "elements",
    "extraordinary edges": "extraordinary_edges",
    "det J positive everywhere (bound)": "is_positive",
    "smallest det J, over its mean": "min_scaled_detj",
    "place of the smallest det J": "min_detj_at",
    "in element": "min_detj_element",
    "volume, model units³": "volume",
    "place farthest from the input": "farthest_at",
}


def warnings(report: Json) -> str:
    """The warnings about the input and the run."""
    items = "".join(f"<li>{show(text)}</li>" for text in report.get("warnings", ()))
    return section("warnings", "Warnings", f"<ul>{items}</ul>") if items else ""


def surface(state: RunState, report: Json, pictures: Pictures) -> str:
    """The input as it was read."""
    numbers = dict(report.get("input", {}))
    box = np.array(numbers.pop("bbox", [[0] * 3] * 2))
    if not numbers:
        return ""
    size = " × ".join(show(float(s)) for s in np.ptp(box, axis=0))
    numbers["volume, model units³"] = numbers.pop("volume", None)
    diagonal = float(np.linalg.norm(np.ptp(box, axis=0)))
    rows = {**numbers, "size, model units": size, "diagonal, model units": diagonal}
    picture = figure(pictures.get("input"), "Input surface; sharp edges drawn.")
    return section("input", "Input", grid(picture, facts(rows)))


def structure(state: RunState, report: Json, pictures: Pictures) -> str:
    """The polycube, the labels, and the ranking."""
    numbers = dict(_named(report.get("polycube", {})))
    candidates = list(numbers.pop("candidates", ()))
    chosen = numbers.pop("chosen", 0)
    if "grid" in numbers:
        numbers["grid"] = " × ".join(map(str, numbers["grid"]))
    axes = swatches(AXES, AXIS_COLOURS)
    pictured = grid(
        figure(pictures.get("polycube"), "Polycube; a colour per face direction.", axes),
        figure(pictures.get("labels"), "The same colours on the input: labels and patches.", axes),
    )
    ranking = ""
    if candidates:
        rows = [
            {"rank": i + 1, **{k: v for k, v in _named(row).items() if k != "key"}}
            for i, row in enumerate(candidates)
        ]
        shown = rows[: max(N_CANDIDATES, chosen + 1)]
        ranking = folded(
            f"Ranking of {len(rows)} proposals",
            "<p>A short registration of each; the smallest score is tried first. "
            "Probability: by the trained classifier, among all structures of the part's genus "
            "that lie along the same axes. "
            f"Meshed: rank {chosen + 1}.</p>{table(shown, chosen)}",
        )
    proposed = figure(pictures.get("proposals"), _proposed(state), axes, wide=True)
    stated = facts(numbers) if numbers else ""
    return section("structure", "Structure", pictured, stated, proposed, ranking)


def _proposed(state: RunState) -> str:
    """The caption of the sheet of proposals."""
    told = []
    for number, entry in enumerate(proposals.distinct(state.ranked), 1):
        candidate, share = entry.candidate, entry.candidate.probability
        told.append(f"{number} {candidate.proposal}{'' if share is None else f' ({share:.0%})'}")
    return (
        f"The different proposed structures in rows, the best first: {', '.join(told)}. "
        "Probabilities are in brackets; for drawn structures, it is their share of the draws."
    )


def _named(row: Json) -> Json:
    """The row with a short description of the context of a large lattice."""
    context = row.get("context", ())
    if len(context) <= NAMED:
        return row
    n_full = sum(name is not None for name in context)
    return {**row, "context": f"bricks in {n_full} of {len(context)} cells"}


def denoising(report: Json, moving: Pictures) -> str:
    """The points of the diffusion model in each recorded state, if it was used."""
    if not moving:
        return ""
    numbers = report.get("polycube", {})
    moved, most = (numbers.get(f"denoised_to_polycube_{which}") for which in ("mean", "max"))
    last = "" if moved is None else f" Their distance from it is {moved:.3f} cells on average"
    last += "" if most is None else f", {most:.3f} at most."
    context, lies_on = (numbers.get(key) for key in ("context", "denoised_lies_on"))
    if lies_on is not None and lies_on != context:
        last += f" They are on another polycube, {', '.join(map(str, lies_on))}."
    text = (
        "Points x_T of the input, moved to the polycube (x_0) by the diffusion model. The colour "
        "of a point is that of its place on the polycube, paler on sides that face away." + last
    )
    between = (
        "The recorded states, connected by straight lines. With sampler=ddim, the default, no "
        "noise is added between them; with ddpm it is."
    )
    return section(
        "denoising",
        "Denoising",
        figure(moving["trajectory.png"], text, wide=True),
        figure(moving["trajectory.gif"], between),
    )


def spline(state: RunState, report: Json, pictures: Pictures) -> str:
    """The volumetric spline."""
    numbers = report.get("spline", {})
    picture = figure(pictures.get("spline"), "Spline solid with the edges of its Bézier elements.")
    if not numbers and not picture:
        return ""
    diagonal = report.get("hex", {}).get("deviation", {}).get("diagonal")
    told = {name: numbers.get(key) for name, key in SPLINE.items()}
    if "volume_error" in numbers:
        told["volume error, %"] = 100 * numbers["volume_error"]
    facing = facts(told)
    ways = {"spline to input": "spline_to_surface", "input to spline": "surface_to_spline"}
    apart = distance_table(numbers, ways, diagonal)
    return section("spline", "Volumetric spline", grid(picture, facing), apart)


def seconds(report: Json) -> str:
    """The time of each stage."""
    spent = report.get("seconds", {})
    return section("time", "Time", charts.bars(spent)) if spent else ""
