"""Which points, curves and faces of a CAD model the hex mesh keeps, and which it loses."""

from __future__ import annotations

import numpy as np

from polycube.hexmesh.feature_distances import TOLERANCE
from polycube.hexmesh.inspection import inspect
from polycube.surface.curves.acute import acute
from polycube.surface.measures import diagonal
from polycube.types import HexMesh, Json, TriMesh

KINDS = ("point", "curve", "face")


def numbers(mesh: HexMesh, surface: TriMesh) -> Json | None:
    """What `report.json` holds of the features; nothing where the part is no CAD model.

    `lost` lists those farther off than the tolerance, the farthest first; distances are fractions
    of the diagonal.  `acute` lists what is sharper than a hex can follow, the sharpest first.
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
                "faces": [f"cad_face_{face}" for face in each.faces],
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
                "faces": [f"cad_face_{face}" for face in each.faces],
                "names": [_name(surface, face) for face in each.faces],
                "at": list(each.place),
                "degrees": np.degrees(each.angle),
            }
            for each in acute(surface)
        ],
    }


def _name(surface: TriMesh, face: int) -> str:
    """What the file calls a CAD face; "" where it has no name."""
    return surface.region_names[face - 1] if surface.region_names else ""
