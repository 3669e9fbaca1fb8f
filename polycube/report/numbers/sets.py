"""Numbers of the named parts of the boundary: size, place and direction of each set."""

import numpy as np

from polycube.hexmesh.face_groups import measure
from polycube.hexmesh.named_sets import face_set, kind_of
from polycube.surface.measures import face_areas
from polycube.types import HexMesh, TriMesh

Numbers = dict[str, dict[str, object]]


def numbers(mesh: HexMesh, surface: TriMesh) -> Numbers:
    """The numbers of each set of a mesh in `report.json`, by name.

    Lengths are in model units. `normal` is the mean over the area: its length is 1 for a flat set
    and close to 0 for a closed one. `model_area` is the area of a single CAD face, `name` the name
    in the CAD file.
    """
    quads = measure(mesh.vertices[mesh.quads])
    on_model = model_areas(surface)
    found: Numbers = {}
    for name, own in mesh.sets.items():
        if not len(own):
            continue
        share = quads.area[own] / quads.area[own].sum()
        found[name] = {
            "kind": kind_of(name),
            "quads": len(own),
            "area": float(quads.area[own].sum()),
            "centroid": (share @ quads.middle[own]).tolist(),
            "normal": (share @ quads.normal[own]).tolist(),
        }
        if name in mesh.cad_names:
            found[name]["name"] = mesh.cad_names[name]
        if name in on_model:
            found[name]["model_area"] = on_model[name]
    return found


def model_areas(surface: TriMesh) -> dict[str, float]:
    """Area of each CAD face as `cad_face_1` etc.; empty for other surfaces."""
    areas = np.bincount(surface.region, face_areas(surface)) if len(surface.region) else np.zeros(0)
    return {face_set(surface, n): float(areas[n]) for n in np.unique(surface.region).tolist()}
