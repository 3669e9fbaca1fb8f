"""The section of changes to the input before meshing, or of the reconstruction of its surface."""

from markupsafe import Markup

from polycube.report.numbers.verdict import length_unit
from polycube.report.page.templates import NOTHING, element
from polycube.types import Json


def repairs(report: Json) -> Markup:
    """The changes in order, and the displacement of the surface; empty if there are none."""
    numbers = report.get("repair")
    if not numbers:
        return NOTHING
    before, after = numbers["volume_before"], numbers["volume_after"]
    rows = {
        "level": numbers["level"],
        f"largest deviation, {length_unit(report)}": numbers["deviation"],
        "of the diagonal, %": numbers["deviation_percent"],
        "of new faces from the input": numbers["added"],
        "of the input from new faces": numbers["lost"],
        "volume before": before,
        "volume after": after,
        "volume change, %": 100 * (after / before - 1) if before else None,
        "cells of the rebuilt surface": numbers["cell"],
    }
    return element("repairs.html", "repair", numbers["changes"], rows)


def reconstruction(report: Json) -> Markup:
    """How the surface was made of a point cloud; empty where the input was a surface."""
    numbers = report.get("points")
    if not numbers:
        return NOTHING
    normals = numbers["neighbours"]
    rows = {
        "points": numbers["given"],
        "not finite or duplicates": numbers["dropped"],
        "outliers removed": numbers["outliers"],
        f"spacing, {length_unit(report)}": numbers["spacing"],
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
    return element("repairs.html", "points", rows)
