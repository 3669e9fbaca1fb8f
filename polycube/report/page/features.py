"""The section of a CAD model: points, curves and faces that the hex mesh loses."""

from __future__ import annotations

import numpy as np

from polycube.report.numbers.features import KINDS
from polycube.report.page.markup import (
    Pictures,
    figure,
    folded,
    grid,
    point,
    section,
    show,
    swatches,
    table,
)
from polycube.report.pictures.colours import KEPT, LOST_FACE, WORST
from polycube.types import Json

N_SHOWN = 60  # lost features in the table, the farthest first


def features(report: Json, pictures: Pictures) -> str:
    """Counts, a picture, and a list of lost features; empty if the part is not a CAD model."""
    found = report.get("hex", {}).get("features")
    if not found:
        return ""
    counts = [
        {
            "of the CAD model": f"{kind}s",
            "all": found[f"{kind}s"]["all"],
            "lost": found[f"{kind}s"]["lost"],
        }
        for kind in KINDS
    ]
    limit = f"{100 * found['tolerance']:g} %"
    legend = swatches(
        ["preserved curve", "lost curve or point", "lost face"],
        [KEPT, WORST, LOST_FACE],
    )
    return section(
        "features",
        "CAD features",
        "<p>A point is compared with the corners of the boundary quads, a curve with their edges, "
        f"a face with the quads. A feature is lost if more than 5 % of its samples are "
        f"farther away than {limit} of the diagonal.</p>",
        table(counts),
        grid(figure(pictures.get("features"), "The CAD model, from both sides.", legend)),
        _lost(found["lost"]),
        _acute(found.get("acute", [])),
    )


def _lost(features: list[Json]) -> str:
    if not features:
        return ""
    size = features[0]["length"] / features[0]["distance"]  # the diagonal
    digits = 4 - int(np.log10(size))
    rows = [
        {
            "kind": f"{each['kind']}, {each['shape']}" if each["shape"] else each["kind"],
            "of": _faces(each),
            "distance, % of the diagonal": 100 * each["distance"],
            "model units": each["length"],
            "at": point(each["at"], digits),
        }
        for each in features[:N_SHOWN]
    ]
    more = f", the {N_SHOWN} farthest" if len(features) > N_SHOWN else ""
    return folded(f"{show(len(features))} lost features{more}", table(rows))


def _acute(features: list[Json]) -> str:
    if not features:
        return ""
    extent = max(abs(value) for each in features for value in each["at"])
    digits = 4 - int(np.log10(max(extent, 1e-300)))
    rows = [
        {
            "kind": each["kind"],
            "of": _faces(each),
            "angle, degrees": round(each["degrees"], 1),
            "largest possible scaled Jacobian": round(
                float(np.sin(np.radians(each["degrees"]))), 2
            ),
            "at": point(each["at"], digits),
        }
        for each in features[:N_SHOWN]
    ]
    more = f", the {N_SHOWN} sharpest" if len(features) > N_SHOWN else ""
    title = f"Angles too small for a good hex: {show(len(features))} edges and corners{more}"
    return folded(title, table(rows))


def _faces(feature: Json) -> str:
    """The CAD faces of a feature, with their names in the file."""
    pairs = zip(feature["faces"], feature["names"], strict=True)
    return ", ".join(f"{face} ({name})" if name else face for face, name in pairs)
