"""Numbers of hexes through walls and around holes, compared with the requested ones."""

import numpy as np

from polycube.hexmesh.generation.requests import requests_of
from polycube.hexmesh.generation.requests_met import reached
from polycube.hexmesh.hex_counts import around, through
from polycube.hexmesh.named_sets import cad_sets, kind_of
from polycube.hexmesh.settings import MeshingSettings, least_around
from polycube.types import HexMesh, Json, TriMesh


def numbers(mesh: HexMesh, surface: TriMesh, meshing: Json) -> dict[str, object]:
    """Count hexes at the entries of `meshing.at`, through all walls and around all holes.

    Parameters
    ----------
    mesh : hex mesh with the sets of its boundary
    meshing : settings: `at`, `across_wall`, `around_hole`

    Returns
    -------
    at : for each entry the set, the kind of number, the wanted and the reached value, and whether
        it is met; a size in model units; `reached` is None if no quad is on the face
    walls, holes : number of counted ones; walls are CAD faces or, without these, patches
    fewer : for those with fewer hexes than `across_wall` and `around_hole` the same numbers as for
        the entries, in ascending ratio to the wanted number
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
    faces = [name for name in cad_sets(surface).alone.values() if name in mesh.sets]
    faces = faces or [name for name in mesh.sets if kind_of(name) == "patch"]
    walls = {name: float(np.median(count[mesh.sets[name]])) for name in faces}
    holes = {n: float(around(mesh, q)) for n, q in mesh.sets.items() if kind_of(n) == "hole"}
    fewer: list[Json] = []
    for kind, setting, found in (
        ("through", "across_wall", walls),
        ("around", "around_hole", holes),
    ):
        least = least_around(meshing.get(setting, getattr(MeshingSettings, setting)))
        few = {name: has for name, has in found.items() if has < least}
        fewer += [{"at": n, "kind": kind, "wanted": least, "reached": few[n]} for n in few]
    fewer.sort(key=lambda row: row["reached"] / row["wanted"])
    return {"at": at, "walls": len(walls), "holes": len(holes), "fewer": fewer}
