"""Points, curves and faces of a CAD model that the hex mesh keeps or loses."""

from __future__ import annotations

import numpy as np

from polycube.hexmesh.cad_sets import face_set
from polycube.hexmesh.feature_distances import TOLERANCE
from polycube.hexmesh.inspection import inspect
from polycube.surface.curves.acute import acute
from polycube.surface.measures import diagonal
from polycube.types import HexMesh, Json, TriMesh

KINDS = ("point", "curve", "face")


def numbers(mesh: HexMesh, surface: TriMesh) -> Json | None:
    """The features in `report.json`; None if the part is not a CAD model.

    `lost` has those farther away than the tolerance, the farthest first; distances are fractions of
    the diagonal. `acute` has the angles that are too small for a hex, the smallest first.
    """
    found = inspect(mesh, surface).features
    if not found:
        return None
    lost = sorted((each for each in found if each.is_lost), key=lambda each: -each.distance)
    size = diagonal(surface)
    return {
        "tolerance": TOLERANCE,
        **{
            f"{kind}s": {
                "all": sum(each.kind == kind for each in found),
                "lost": sum(each.kind == kind for each in lost),
            }
            for kind in KINDS
        },
        "lost": [
            {
                "kind": each.kind,
                "shape": each.shape,
                "faces": [face_set(surface, face) for face in each.faces],
                "names": [_name(surface, face) for face in each.faces],
                "at": list(each.place),
                "distance": each.distance,
                "length": each.distance * size,
            }
            for each in lost
        ],
        "acute": [
            {
                "kind": each.kind,
                "faces": [face_set(surface, face) for face in each.faces],
                "names": [_name(surface, face) for face in each.faces],
                "at": list(each.place),
                "degrees": np.degrees(each.angle),
            }
            for each in acute(surface)
        ],
    }


def _name(surface: TriMesh, face: int) -> str:
    """Name of a CAD face in the file; "" if there is none."""
    return surface.region_names[face - 1] if surface.region_names else ""
