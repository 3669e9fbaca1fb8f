"""Numbers of hexes through walls and round holes, beside those that were asked for."""

from __future__ import annotations

import numpy as np

from polycube.hexmesh.generation.requests import requests_of
from polycube.hexmesh.generation.requests_met import reached
from polycube.hexmesh.hex_counts import around, through
from polycube.hexmesh.named_sets import kind_of
from polycube.hexmesh.settings import MeshingSettings
from polycube.types import HexMesh, Json, TriMesh


def numbers(mesh: HexMesh, surface: TriMesh, meshing: Json) -> dict[str, object]:
    """Count hexes at the entries of `meshing.at`, through all walls and round all holes.

    Parameters
    ----------
    mesh : with the sets of its boundary
    meshing : settings: `at`, `across_wall`, `around_hole`

    Returns
    -------
    at : of each entry the set, the kind of number, what is wanted and what there is, and whether
        that is enough; a size in model units; `reached` is None where no quad is on the face
    walls, holes : how many were counted; walls are CAD faces or, without these, patches
    fewer : of those that have fewer hexes than `across_wall` and `around_hole` the same numbers as
        of the entries, the share of what is wanted ascending
    """
    requests = requests_of(meshing.get("at") or ())
    at = [
        {
            "at": request.at,
            "kind": request.kind,
            "wanted": request.wanted(surface),
            "reached": has,
            "met": request.is_met(surface, has),
        }
        for request, has in zip(requests, reached(mesh, surface, requests), strict=True)
    ]
    count = through(mesh)[0]
    faces = [name for name in mesh.sets if name.removeprefix("cad_face_").isdigit()]
    faces = faces or [name for name in mesh.sets if kind_of(name) == "patch"]
    walls = {name: float(np.median(count[mesh.sets[name]])) for name in faces}
    holes = {n: float(around(mesh, q)) for n, q in mesh.sets.items() if kind_of(n) == "hole"}
    fewer: list[Json] = []
    for kind, setting, found in (
        ("through", "across_wall", walls),
        ("around", "around_hole", holes),
    ):
        least = meshing.get(setting, getattr(MeshingSettings, setting))
        fewer += [
            {"at": name, "kind": kind, "wanted": least, "reached": has}
            for name, has in found.items()
            if has < least
        ]
    fewer.sort(key=lambda row: row["reached"] / row["wanted"])
    return {"at": at, "walls": len(walls), "holes": len(holes), "fewer": fewer}
