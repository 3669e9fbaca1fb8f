"""The section of changes to the input before meshing."""

from __future__ import annotations

from html import escape

from polycube.report.page.markup import facts, section
from polycube.types import Json


def repairs(report: Json) -> str:
    """The changes in order, and the displacement of the surface; empty if there are none."""
    numbers = report.get("repair")
    if not numbers:
        return ""
    changes = "".join(f"<li>{escape(change)}</li>" for change in numbers["changes"])
    told = f"<ul>{changes}</ul>" if changes else "<p>There was nothing to repair.</p>"
    before, after = numbers["volume_before"], numbers["volume_after"]
    rows = {
        "level": numbers["level"],
        "largest deviation, model units": numbers["deviation"],
        "of the diagonal, %": numbers["deviation_percent"],
        "of new faces from the input": numbers["added"],
        "of the input from new faces": numbers["lost"],
        "volume before": before,
        "volume after": after,
        "volume change, %": 100 * (after / before - 1) if before else None,
        "cells of the rebuilt surface": numbers["cell"],
    }
    return section("repair", "Repair", told, facts(rows))
