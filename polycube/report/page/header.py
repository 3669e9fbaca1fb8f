"""The top of the page, and the first sheet of paper: origin, verdict, main numbers, mesh."""

from markupsafe import Markup

from polycube.report.numbers.verdict import about, tiles, verdict, why
from polycube.report.page.templates import render
from polycube.types import Json


def header(report: Json, picture: bytes | None = None) -> Markup:
    """The summary of a run.

    Parameters
    ----------
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
