"""The HTML pages of a run, an assembly and a batch, which need no network and no other file."""

import json
import re
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType

from markupsafe import Markup

from polycube import __version__
from polycube.io import manifest
from polycube.report.citation import bibtex
from polycube.report.numbers.problem import problem_of
from polycube.report.numbers.verdict import about, length_unit, tiles, verdict, why
from polycube.report.page import sections
from polycube.report.page.hexes import features, hex_counts, hexes, sets
from polycube.report.page.templates import NOTHING, Link, Pictures, element, render
from polycube.report.page.views.viewer import viewer
from polycube.report.pictures.pictures import pictures
from polycube.state import RunState
from polycube.types import HexMesh, Json, Solution, Spline


def write_report(folder: Path, state: RunState, report: Json, drawing: bool = True) -> Path:
    """Write `folder/report.html`, also for a run that ended early.

    report : the numbers of `report.json`, and the settings under "config"
    drawing : whether to draw pictures, which takes seconds; the 3D view is always included

    A denoising is also drawn to `trajectory.png`.
    """
    drawn = pictures(state, problem_of(report.get("config", {}))) if drawing else {}
    moving = {"trajectory.png": drawn["denoising"]} if "denoising" in drawn else {}
    here = {name for name in manifest.files(folder) if "/" not in name}
    here |= {*moving, "report.json", "config.json"}
    unit, chosen = length_unit(report), report.get("config")
    section = partial(element, sections.TEMPLATE)
    diagonal = report.get("hex", {}).get("deviation", {}).get("diagonal")
    parts = [
        sections.view(state, report),
        section("warnings", report.get("warnings")),
        hexes(state, report, drawn),
        hex_counts(report),
        features(report, drawn),
        sets(state, report, drawn),
        section("spline", drawn.get("spline"), report.get("spline", {}), diagonal, unit),
        sections.problem(report, drawn),
        sections.solution(state.spline, state.solution, report, drawn),
        section("input", drawn.get("input"), report.get("input", {}), unit),
        element("repairs.html", "points", report.get("points"), unit),
        element("repairs.html", "repair", report.get("repair"), unit),
        sections.structure(state, report, drawn),
        section("denoising", drawn.get("denoising"), report.get("polycube", {})),
        section("search", report.get("search", []), report.get("seconds", {})),
        section("settings", _yaml(chosen), bibtex(report, chosen)) if chosen else NOTHING,
        section("files", here - {"report.html"}),
    ]
    name = Path(str(report.get("input", {}).get("path", "part"))).name
    body = Markup("\n").join(filter(None, parts))
    text = page(name, body, header(report, drawn.get("hex")), f"seed {report.get('seed', '')}")
    with manifest.writing(folder) as scratch:
        for name, image in moving.items():
            (scratch / name).write_bytes(image)
        (scratch / "report.html").write_text(text, encoding="utf-8")
    return folder / "report.html"


def page(
    title: str, body: Markup, head: Markup = NOTHING, note: str = "", subtitle: str = ""
) -> str:
    """A complete page; `body` and `head` are HTML, the others plain text."""
    found = re.findall(r'<section id="(\w+)"><h2>([^<]*)</h2>', body)
    return render(
        "page.html",
        title=title,
        subtitle=subtitle,
        head=head,
        links=[(anchor, Markup(title)) for anchor, title in found],
        body=body,
        note=", ".join(filter(None, [f"polycube {__version__}", note])),
    )


def _yaml(value: Json, indent: int = 0) -> str:
    """Nested mappings as indented lines; other values as JSON, which is valid YAML."""
    lines = []
    for name, item in value.items():
        if isinstance(item, Mapping) and item:
            lines.append(f"{' ' * indent}{name}:\n{_yaml(item, indent + 2)}")
        else:
            lines.append(f"{' ' * indent}{name}: {json.dumps(item, default=str)}")
    return "\n".join(lines)


def header(report: Json, picture: bytes | None = None) -> Markup:
    """The summary of a run.

    report : the numbers of `report.json`
    picture : the hex mesh, which is shown on paper in place of the 3D view
    """
    return render(
        "header.html",
        about=about(report),
        verdict=verdict(report),
        why=why(report),
        tiles=tiles(report),
        problem=report.get("problem"),
        picture=picture,
    )


def summary_page(rows: Sequence[Mapping[str, object]], columns: Sequence[str], folder: Path) -> str:
    """HTML of the table; "folder" of a row is the folder of its report, below `folder`."""
    shown = [name for name in columns if name != "folder"]
    table = [{name: row.get(name) for name in shown} for row in rows]
    for row, cells in zip(rows, table, strict=True):
        report = f"{row['folder']}/report.html"
        if (folder / report).is_file():
            cells["part"] = Link(str(row["part"]), report)
    return page(f"{len(rows)} parts", element("elements.html", "table", table))


def assembly_page(
    title: str,
    report: Json,
    mesh: HexMesh | None,
    folder: Path,
    files: Sequence[str],
    solved: tuple[Spline | None, Solution | None, Pictures] = (None, None, MappingProxyType({})),
) -> str:
    """HTML of an assembly: a row per solid with a link to its report, and the contacts.

    report : the numbers of `report.json`
    mesh : mesh of all solids, with the number of the solid of each hex as `cell`, and the names
    folder : folder that contains the folders of the solids
    files : files of the assembly in this folder
    solved : spline and solution of all solids together, and their pictures
    """
    made = [(solid["name"], f"{solid['name']}/report.html") for solid in report["solids"]]
    body = render(
        "assembly.html",
        view="" if mesh is None else viewer(mesh, context=mesh.primitives, filled="solid"),
        solids=report["solids"],
        links={name: Link(name, target) for name, target in made if (folder / target).is_file()},
        contacts=report["contacts"],
        problem=sections.problem(report, solved[2]),
        solution=sections.solution(*solved[:2], report, solved[2]),
        not_analysed=report.get("not_analysed"),
        merged=report.get("hex", {}).get("merged_vertices"),
        files=[Link(name, name) for name in files],
    )
    return page(title, body, header(report))
