"""The top of the page: the verdict with its reasons, and the main numbers."""

from __future__ import annotations

from markupsafe import Markup

from polycube.report.numbers.verdict import subtitle, tiles, verdict, why
from polycube.report.page.templates import render
from polycube.types import Json


def header(report: Json) -> Markup:
    """Subtitle, verdict, reasons and main numbers, from the numbers of `report.json`."""
    return render(
        "header.html",
        subtitle=subtitle(report),
        verdict=verdict(report),
        why=why(report),
        tiles=tiles(report),
    )
