"""The page of an assembly: a row per solid with a link to its report, and the contacts."""

from collections.abc import Sequence
from pathlib import Path

from polycube.report.page.html import header, page
from polycube.report.page.templates import Link, render
from polycube.report.page.views.viewer import viewer
from polycube.types import HexMesh, Json


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
    made = [(solid["name"], f"{solid['name']}/report.html") for solid in report["solids"]]
    body = render(
        "assembly.html",
        view="" if mesh is None else viewer(mesh, context=mesh.primitives, filled="solid"),
        solids=report["solids"],
        links={name: Link(name, target) for name, target in made if (folder / target).is_file()},
        contacts=report["contacts"],
        merged=report.get("hex", {}).get("merged_vertices"),
        files=[Link(name, name) for name in files],
    )
    return page(title, body, header(report))
