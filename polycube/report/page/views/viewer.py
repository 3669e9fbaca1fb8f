"""Interactive 3D view of the hex mesh in the page: rotate, cut, filter and colour."""

import base64
import zlib
from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from polycube.hexmesh.connectivity import FACES, neighbours, on_faces, quad_sides
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.report.numbers.quality import quad_deviation
from polycube.report.numbers.verdict import UNKNOWN
from polycube.report.page.templates import NOTHING, render, show
from polycube.report.page.views.overlays import results, simplified
from polycube.report.pictures import features
from polycube.report.pictures.colours import CELLS, DEVIATION_COLOURS, QUALITY_COLOURS, rgb
from polycube.report.pictures.fields import AMPLITUDE
from polycube.report.pictures.render import view
from polycube.types import Goal, HexMesh, Json, Solution, Spline, TriMesh

# number of hexes up to which all are shown; above, only those on the boundary and the worst
ALL_SHOWN = 60_000
WORST = 1_000  # number of hexes with the smallest scaled Jacobian that are always shown
MOST = 200_000  # largest number of shown hexes, which limits the size of the page
N_NAMED = 12  # largest number of grid cells with a name below the view
PRIMITIVE = "primitive"  # content of a cell
N_SETS = 16  # largest number of set colours in the legend; a click shows all names


def viewer(
    mesh: HexMesh,
    surface: TriMesh | None = None,
    context: Sequence[str | None] = (),
    filled: str = PRIMITIVE,
    unit: str = UNKNOWN,
    solved: tuple[Spline, Solution] | None = None,
    goal: Goal = features.DEFAULT,
) -> Markup:
    """Markup of the 3D view; empty if more than `MOST` hexes would be shown.

    For a mesh of more than `ALL_SHOWN` hexes, the page has those with a face on the boundary and
    the `WORST` ones.

    surface : the input; None: no colours by distance
    context : primitive per grid cell; empty if it is unknown
    filled : description of the cells if they are not primitives; they are not coloured then
    solved : spline and solution of the analysis, for the colours by results
    goal : limits of the features that are marked
    """
    quality = scaled_jacobian(mesh.vertices, mesh.hexes)
    shown = _shown(mesh, quality)
    if len(shown) > MOST:
        return NOTHING
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    size = float(np.linalg.norm(high - low))
    used, hexes = np.unique(mesh.hexes[shown], return_inverse=True)
    places = (mesh.vertices[used] - (low + high) / 2) / size
    distance = np.full((len(mesh.hexes), 6), -1.0)  # of faces; inside, or without a surface
    drawn = np.zeros((0, 3)), np.zeros((0, 3), np.int64)
    segments = np.zeros((0, 2, 3))
    if surface is not None:
        distance = on_faces(mesh, quad_deviation(mesh, surface))
        segments, drawn = features.lost_segments(mesh, surface, goal), simplified(surface)
    number, sets = features.memberships(mesh)
    _, first = np.unique(number, return_index=True)
    # indices of hexes among the shown ones; -1 stays -1, and a hex that is not shown has -2
    next_ = beyond(mesh.hexes)[shown]
    place = np.searchsorted(shown, next_).clip(max=len(shown) - 1)
    arrays: tuple[np.ndarray, ...] = (
        places.astype("<f4"),
        _steps(hexes.reshape(-1, 8)),
        _steps(np.where(next_ < 0, -1, np.where(shown[place] == next_, place, -2))),
        quality[shown].astype("<f4"),
        distance[shown].astype("<f4"),
        _steps(mesh.cell[shown]),
        on_faces(mesh, number)[shown].astype("<i4"),
        _steps(shown),
    )
    found = [] if solved is None else results(*solved, mesh.vertices[used], unit)
    arrays += ((drawn[0] - (low + high) / 2) / size).astype("<f4"), _steps(drawn[1])
    arrays += tuple(array for result in found for array in result.arrays())
    packed = zlib.compress(b"".join(array.tobytes() for array in arrays), 9)
    cells = np.unique(mesh.cell).tolist()
    primitives = [context[c] if c < len(context) else None for c in range(max(cells) + 1)]
    names = sorted({primitives[c] for c in cells} - {None})
    data = {
        "V": len(places),
        "H": len(shown),
        "all": len(mesh.hexes),
        "faces": FACES.tolist(),
        "low": places.min(0).tolist(),
        "high": places.max(0).tolist(),
        "middle": ((low + high) / 2).tolist(),
        "size": size,
        "view": view().tolist(),
        "extent": np.abs(places @ view().T).max(0).tolist(),
        "colours": rgb(QUALITY_COLOURS).tolist(),
        "far": rgb(DEVIATION_COLOURS).tolist(),
        "farthest": float(max(distance.max(), 0)),
        "cells": rgb(CELLS).tolist(),
        "sets": sets,
        "lost": ((segments - (low + high) / 2) / size).astype("<f4").ravel().tolist(),
        "set_colours": rgb(tuple(features.quad_colours(mesh)[first].tolist())).tolist(),
        "names": names,
        "primitive": [names.index(p) if p in names else 0 for p in primitives],  # of each cell
        "S": len(drawn[0]),
        "T": len(drawn[1]),
        "complete": surface is None or len(drawn[1]) == len(surface.faces),
        "results": [result.numbers() for result in found],
        "amplitude": AMPLITUDE,
        "data": base64.b64encode(packed).decode(),
    }
    legends = _legends(mesh, data, None if surface is None else unit, filled)
    for place, result in enumerate(found):
        legends[f"result{place}"] = _bar(result.title, result.colours, *result.labels)
    return render("viewer.html", data=data, legends=legends)


def _shown(mesh: HexMesh, quality: np.ndarray) -> np.ndarray:
    """(S,) numbers of the hexes in the page, ascending."""
    if len(mesh.hexes) <= ALL_SHOWN:
        return np.arange(len(mesh.hexes))
    worst = np.argpartition(quality, min(WORST, len(quality) - 1))[:WORST]
    return np.union1d(quad_sides(mesh)[0], worst)


def _steps(values: np.ndarray) -> np.ndarray:
    """Differences of rows as int32, starting from 0, which compress well for hexes in rows."""
    return np.diff(values, axis=0, prepend=np.zeros_like(values[:1])).astype("<i4")


def _legends(mesh: HexMesh, data: Json, unit: str | None, filled: str) -> dict[str, Json]:
    """Title of each colouring, with the ends of its colour bar or the names of its colours.

    unit : length unit of the distances; None without distances
    """
    cells, names = np.unique(mesh.cell).tolist(), data["names"]
    found: dict[str, Json] = {
        "quality": _bar("scaled Jacobian", QUALITY_COLOURS, "0 scaled Jacobian", "1")
    }
    if unit is not None:
        far = f"{show(data['farthest'])} {unit} from the input"
        found["distance"] = _bar("distance from the input", DEVIATION_COLOURS, "0", far)
    if len(cells) > 1 and filled == PRIMITIVE:
        named = [(str(cell), CELLS[cell % len(CELLS)]) for cell in cells]
        found["cell"] = _named("grid cell", named, N_NAMED)
    first: dict[str, str] = {}  # set of each colour
    for name, colour in features.set_colours(mesh).items():
        first.setdefault(colour, name)
    if first:
        named = [(name, colour) for colour, name in first.items()]
        found["set"] = _named("named set", named, N_SETS)
    if len(names) > 1:
        named = [(name, CELLS[i % len(CELLS)]) for i, name in enumerate(names)]
        found["primitive"] = _named(filled, named, len(named))
    return found


def _bar(title: str, stops: Sequence[str], low: str, high: str) -> Json:
    return {"title": title, "stops": stops, "low": low, "high": high}


def _named(title: str, named: list[tuple[str, str]], most: int) -> Json:
    more = f", and {len(named) - most} more" if len(named) > most else ""
    return {"title": title, "named": named[:most], "more": more}


def beyond(hexes: np.ndarray) -> np.ndarray:
    """(H, 6) the hex on the other side of each face, -1 outside."""
    found = np.full(6 * len(hexes), -1)
    a, b = neighbours(hexes)
    found[a], found[b] = b // 6, a // 6
    return found.reshape(-1, 6)
