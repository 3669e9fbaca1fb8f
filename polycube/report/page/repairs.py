"""The section of changes to the input before meshing, or of the reconstruction of its surface."""

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


def reconstruction(report: Json) -> str:
    """How the surface was made of a point cloud; empty where the input was a surface."""
    numbers = report.get("points")
    if not numbers:
        return ""
    normals = numbers["neighbours"]
    rows = {
        "points": numbers["given"],
        "not finite or duplicates": numbers["dropped"],
        "outliers removed": numbers["outliers"],
        "spacing, model units": numbers["spacing"],
        "normals": "those of the file" if normals is None else f"from {normals} neighbours",
        "normals that agree with the surface, %": 100 * numbers["normals_agree"],
        "cells of the reconstruction": numbers["cell"],
        "mean distance of the points from the surface": numbers["deviation_mean"],
        "of 95 % of the points at most": numbers["deviation_p95"],
        "largest": numbers["deviation_max"],
        "largest, % of the diagonal": numbers["deviation_max_percent"],
        "of the surface from the points, largest": numbers["farthest"],
        "area without points, %": 100 * numbers["made_up"],
        "points added there": numbers["added"],
    }
    return section("points", "Surface of the point cloud", facts(rows))
