"""The section of a CAD model: points, curves and faces that the hex mesh loses."""

import numpy as np
from markupsafe import Markup

from polycube.report.numbers.features import KINDS, limit
from polycube.report.numbers.verdict import length_unit
from polycube.report.page.templates import NOTHING, Pictures, Row, point, render
from polycube.types import Json

N_SHOWN = 60  # lost features in the table, the farthest first


def features(report: Json, pictures: Pictures) -> Markup:
    """Counts, a picture, and a list of lost features; empty if the part is not a CAD model."""
    found = report.get("hex", {}).get("features")
    if not found:
        return NOTHING
    counts = [{"of the CAD model": f"{kind}s", **found[f"{kind}s"]} for kind in KINDS]
    return render(
        "features.html",
        found=found,
        most=N_SHOWN,
        counts=counts,
        limit=limit(found),
        picture=pictures.get("features"),
        lost=_lost(found["lost"], length_unit(report)),
        acute=_acute(found.get("acute", [])),
    )


def _lost(features: list[Json], unit: str) -> list[Row]:
    """Rows of the lost features, the farthest first."""
    if not features:
        return []
    size = features[0]["length"] / features[0]["distance"]  # the diagonal
    digits = 4 - int(np.log10(size))
    return [
        {
            "kind": f"{each['kind']}, {each['shape']}" if each["shape"] else each["kind"],
            "of": _faces(each),
            "distance, % of the diagonal": 100 * each["distance"],
            unit: each["length"],
            "at": point(each["at"], digits),
        }
        for each in features[:N_SHOWN]
    ]


def _acute(features: list[Json]) -> list[Row]:
    """Rows of the sharp places, the sharpest first."""
    if not features:
        return []
    extent = max(abs(value) for each in features for value in each["at"])
    digits = 4 - int(np.log10(max(extent, 1e-300)))
    return [
        {
            "kind": each["kind"],
            "of": _faces(each),
            "angle, degrees": round(each["degrees"], 1),
            "largest possible scaled Jacobian": np.sin(np.radians(each["degrees"])).round(2),
            "at": point(each["at"], digits),
        }
        for each in features[:N_SHOWN]
    ]


def _faces(feature: Json) -> str:
    """The CAD faces of a feature, with their names in the file."""
    pairs = zip(feature["faces"], feature["names"], strict=True)
    return ", ".join(f"{face} ({name})" if name else face for face, name in pairs)
