"""The page of an assembly: a row per solid with a link to its report, and the contacts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from polycube.report.numbers.verdict import subtitle, verdict
from polycube.report.page.html import page
from polycube.report.page.markup import Link, facts, section, show, table
from polycube.report.page.viewer import viewer
from polycube.types import HexMesh, Json

SAME = (
    "<p class=note>Meshes agree at a contact if quads with equal vertices cover it. There, hex.vtu "
    "has the vertices only once; elsewhere each solid has its own.</p>"
)


def assembly_page(
    title: str, report: Json, mesh: HexMesh | None, folder: Path, files: Sequence[str]
) -> str:
    """HTML of an assembly.

    Parameters
    ----------
    title : title of the page
    report : the numbers of `report.json`
    mesh : mesh of all solids, with the number of the solid of each hex as `cell`, and the names
    folder : folder that contains the folders of the solids
    files : files of the assembly in this folder
    """
    view = viewer(mesh, context=mesh.primitives, filled="solid") if mesh is not None else ""
    body = [
        section("view", "3D view", view),
        section("solids", "Solids", _solids(report, folder)),
        section("contacts", "Contacts", *_contacts(report)),
        section("files", "Files", *(f"<p>{show(Link(name, name))}</p>" for name in files)),
    ]
    return page(title, verdict(report), "\n".join(filter(None, body)), "", subtitle(report))


def _solids(report: Json, folder: Path) -> str:
    rows = []
    for solid in report["solids"]:
        target = f"{solid['name']}/report.html"
        is_there = (folder / target).is_file()
        rows.append(
            {
                "solid": Link(solid["name"], target) if is_there else solid["name"],
                "number": solid["number"],
                "same as": solid.get("same_as"),
                "volume": solid["volume"],
                "hexes": solid["hexes"],
                "least scaled Jacobian": solid["min_scaled_jacobian"],
                "features kept": _kept(solid["features"]),
                "result": solid["result"],
                "exit": solid["exit"],
                "says": solid["says"] or None,
            }
        )
    return table(rows)


def _kept(features: Mapping[str, Mapping[str, int]] | None) -> str | None:
    if not features:
        return None
    counts = [features[kind] for kind in ("points", "curves", "faces")]
    total = sum(each["all"] for each in counts)
    return f"{total - sum(each['lost'] for each in counts)} of {total}"


def _contacts(report: Json) -> list[str]:
    if not report["contacts"]:
        return ["<p>No two solids touch.</p>"]
    found = report["contacts"]
    rows = [
        {
            "solids": " – ".join(each["solids"]),
            "faces": " – ".join(map(_face, each["faces"], each["names"])),
            "area": each["area"],
            "meshes agree": each["agree"],
            "quads": " – ".join(map(show, each.get("quads", ()))) or None,
            "common quads": each.get("common_quads"),
            "of the area": _share(each),
        }
        for each in found
    ]
    agreeing = [each["area"] for each in found if each["agree"]]
    numbers = {
        "contacts": len(found),
        "with agreeing meshes": len(agreeing),
        "area": sum(each["area"] for each in found),
        "with agreeing meshes, area": sum(agreeing),
        "merged vertices": report.get("hex", {}).get("merged_vertices"),
    }
    return [facts(numbers), table(rows), SAME]


def _face(number: str, name: str) -> str:
    return f"{number} ({name})" if name else number


def _share(contact: Json) -> str | None:
    if "common_area" not in contact:
        return None
    return f"{100 * contact['common_area'] / contact['area']:.3g} %"
