"""The section of a CAD model: points, curves and faces that the hex mesh loses."""

import numpy as np
from markupsafe import Markup

from polycube.report.numbers.features import KINDS, limit
from polycube.report.numbers.verdict import length_unit
from polycube.report.page.templates import NOTHING, Pictures, render
from polycube.types import Json

N_SHOWN = 60  # lost features in the table, the farthest first


def features(report: Json, pictures: Pictures) -> Markup:
    """Counts, a picture, and a list of lost features; empty if the part is not a CAD model."""
    found = report.get("hex", {}).get("features")
    if not found:
        return NOTHING
    lost, sharp = found["lost"], found.get("acute", [])
    size = lost[0]["length"] / lost[0]["distance"] if lost else 1.0  # the diagonal
    sharp = [{**each, "best": np.sin(np.radians(each["degrees"])).round(2)} for each in sharp]
    extent = max([abs(value) for each in sharp for value in each["at"]], default=1.0)
    return render(
        "features.html",
        found=found,
        sharp=sharp,
        most=N_SHOWN,
        counts=[{"of the CAD model": f"{kind}s", **found[f"{kind}s"]} for kind in KINDS],
        limit=limit(found),
        picture=pictures.get("features"),
        unit=length_unit(report),
        digits=4 - int(np.log10(size)),
        sharp_digits=4 - int(np.log10(max(extent, 1e-300))),
    )
