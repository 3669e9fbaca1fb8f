"""A page of results from the folders of runs:

    python -m docs.generators.gallery docs outputs/gallery/*

writes `docs/gallery.md` with a strip of pictures per run in `docs/gallery/`, and the numbers of
their `report.json`.
"""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from polycube.errors import InputError
from polycube.io.atomic import atomic_write
from polycube.pipeline.resume.results import load_stage
from polycube.report.pictures import fields, scenes
from polycube.report.pictures.pictures import draw
from polycube.report.pictures.render import Film, Scene
from polycube.types import Json

TILE = (250, 190)  # size of a picture in pixels
Draw = Callable[[dict[str, Scene]], dict[str, bytes]]  # PNG pictures of scenes
SHADES = 64  # colours of a strip; limits eight strips to a few hundred kilobytes
HEAD = """# Gallery

Each row of pictures shows the input surface, the polycube, the hex mesh, a cut through it, and the
spline in its first elastic mode, with automatic settings. The parts are the examples of the
program. `make gallery` runs all steps on them and writes this page and its pictures;
`python -m docs.generators.gallery` writes such a page for any finished runs. Results on the parts
of other authors are in [results.md](notes/results.md).

"""
COLUMNS = (
    "part",
    "polycube (proposal)",
    "hexes",
    "least / mean SJ",
    "surface to mesh",
    "functions",
    "surface to spline",
)
LEGEND = """
SJ: scaled Jacobian. Distances: of 99 % of the surface's points, in per cent of the bounding-box
diagonal.

"""


def gallery(folder: Path, runs: Sequence[Path], draw: Draw = draw) -> Path:
    """Write the page of finished runs and return its path; runs without a report are omitted.

    Raises InputError if this would overwrite a page that is not a gallery, or a picture that the
    gallery does not show.
    """
    _check_place(folder, runs)
    reports = {run: json.loads((run / "report.json").read_text()) for run in runs if _is_run(run)}
    (folder / "gallery").mkdir(parents=True, exist_ok=True)
    strips = ""
    for run in reports:
        path = folder / "gallery" / f"{run.name}.png"
        with atomic_write(path) as temporary:
            temporary.write_bytes(strip(run, draw))
        strips += f"**{run.name}**\n\n![{run.name}](gallery/{path.name})\n\n"
    lines = [list(COLUMNS), ["---"] * len(COLUMNS)]
    lines += [_row(run.name, report) for run, report in reports.items()]
    table = "".join(f"| {' | '.join(line)} |\n" for line in lines)
    with atomic_write(folder / "gallery.md") as temporary:
        temporary.write_text(HEAD + table + LEGEND + strips.rstrip() + "\n")
    return folder / "gallery.md"


def _check_place(folder: Path, runs: Sequence[Path]) -> None:
    page = folder / "gallery.md"
    before = page.read_text() if page.exists() else ""
    if before and not before.startswith(HEAD.splitlines()[0]):
        raise InputError(f"{page} is not a gallery and would be overwritten")
    for name in (f"gallery/{run.name}.png" for run in runs):
        if (folder / name).exists() and f"({name})" not in before:
            raise InputError(f"{folder / name} does not belong to {page} and would be overwritten")


def strip(run: Path, draw: Draw) -> bytes:
    """PNG of the pictures of a run side by side, with gaps for those that cannot be drawn."""
    from PIL import Image

    pictures = pictured(run)
    drawn = draw(pictures)
    sheet = Image.new("RGB", (TILE[0] * len(pictures), TILE[1]), "white")
    for column, name in enumerate(pictures):
        if name in drawn:
            tile = Image.open(io.BytesIO(drawn[name])).convert("RGBA").convert("RGB")
            tile.thumbnail((TILE[0] - 10, TILE[1] - 10))
            corner = [(room - size) // 2 for room, size in zip(TILE, tile.size, strict=True)]
            sheet.paste(tile, (corner[0] + column * TILE[0], corner[1]))
    file = io.BytesIO()
    sheet.quantize(SHADES, dither=Image.Dither.NONE).save(file, "PNG", optimize=True)
    return file.getvalue()


def pictured(run: Path) -> dict[str, Scene]:
    """The pictures of the stages that a run reached."""
    surface = load_stage(run, "read")[0]
    ranked, chosen = load_stage(run, "structure")
    candidate = ranked[chosen].candidate
    found = {
        "surface": scenes.input_surface(surface),
        "polycube": scenes.polycube_faces(candidate.polycube, candidate.rough_map),
    }
    if (run / "stages" / "meshing.optimize.npz").is_file():
        last = "refine" if (run / "stages" / "meshing.refine.npz").is_file() else "optimize"
        hexes = load_stage(run, f"meshing/{last}")
        found |= {"hex": scenes.hex_outside(hexes), "cut": scenes.hex_cut(hexes)}
    if (run / "stages" / "analysis.npz").is_file():
        spline, solution = load_stage(run, "spline"), load_stage(run, "analysis")
        name, make = next(iter(fields.makers(spline, solution).items()))
        found[name] = _still(make())
    return found


def _still(shown: Scene | Film) -> Scene:
    """A film at its largest amplitude."""
    if isinstance(shown, Film):
        return [replace(shown.layer, points=shown.layer.points + shown.shift)]
    return shown


def _is_run(run: Path) -> bool:
    return (run / "report.json").is_file()


def _row(name: str, report: Json) -> list[str]:
    polycube, hexes, spline = (report.get(half, {}) for half in ("polycube", "hex", "spline"))
    proposal = polycube["candidates"][polycube["chosen"]]["proposal"]
    context = ", ".join(each or "–" for each in polycube["context"])
    made = f"{polycube['boxes']} bricks" if proposal == "labels" else context
    row = [name, f"{made} ({proposal})"]
    if hexes:
        quality = f"{hexes['min_scaled_jacobian']:.2f} / {hexes['mean_scaled_jacobian']:.2f}"
        row += [str(hexes["hexes"]), quality, f"{100 * hexes['surface_to_mesh_p99']:.2f}"]
    if spline:
        row += [str(spline["functions"]), f"{100 * spline['surface_to_spline_p99']:.2f}"]
    return row + [""] * (len(COLUMNS) - len(row))


if __name__ == "__main__":
    target, *folders = map(Path, sys.argv[1:])
    gallery(target, sorted(folders))
