"""Points, curves and faces of a CAD model that the hex mesh keeps or loses."""

import numpy as np

from polycube.hexmesh.feature_distances import Feature
from polycube.hexmesh.inspection import inspect
from polycube.hexmesh.named_sets import face_set
from polycube.surface.curves.acute import Acute, acute
from polycube.surface.measures import diagonal
from polycube.types import Goal, HexMesh, Json, TriMesh

KINDS = ("point", "curve", "face")


def numbers(mesh: HexMesh, surface: TriMesh, goal: Goal | None = None) -> Json | None:
    """The features in `report.json`; None if the part is not a CAD model.

    `lost` has those farther away than their limit, the farthest first. Distances are fractions of
    the diagonal, and `share` is the limit as a share of the size of a feature. `acute` has the
    angles that are too small for a hex, the smallest first.
    """
    found = inspect(mesh, surface).features
    if not found:
        return None
    goal = goal or Goal()
    lost = sorted((each for each in found if each.exceeds(goal)), key=lambda each: -each.distance)
    size = diagonal(surface)
    return {
        "tolerance": goal.features,
        "share": goal.feature_share,
        **{
            f"{kind}s": {
                "all": sum(each.kind == kind for each in found),
                "lost": sum(each.kind == kind for each in lost),
            }
            for kind in KINDS
        },
        "lost": [
            {
                **_named(surface, each),
                "shape": each.shape,
                "distance": each.distance,
                "limit": each.limit(goal),
                "length": each.distance * size,
            }
            for each in lost
        ],
        "acute": [
            {**_named(surface, each), "degrees": np.degrees(each.angle)} for each in acute(surface)
        ],
    }


def _named(surface: TriMesh, each: Feature | Acute) -> Json:
    return {
        "kind": each.kind,
        "faces": [face_set(surface, face) for face in each.faces],
        "names": [face_name(surface, face) for face in each.faces],
        "at": list(each.place),
    }


def limit(numbers: Json) -> str:
    """The limit of the distance of features in words, from their numbers in `report.json`."""
    of_size = f" and {100 * numbers['share']:g} % of their size" if "share" in numbers else ""
    return f"{100 * numbers['tolerance']:g} % of the diagonal{of_size}"


def face_name(surface: TriMesh, face: int) -> str:
    """Name of a CAD face in the file; "" if there is none."""
    return surface.region_names[face - 1] if surface.region_names else ""
