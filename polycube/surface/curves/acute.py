"""Edges and corners of a part whose angle is too small for a well-shaped hex."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from polycube.surface.fit_target import target
from polycube.surface.measures import corner_angles
from polycube.types import TriMesh

SHARP = np.deg2rad(20)  # a hex with such an angle has a scaled Jacobian below 0.35
# of the diagonal, two hexes: shorter curves of a triangle surface are folds of single triangles
LONG = 0.1
SAME = 1e-9  # of the diagonal: closer points are taken as equal


@dataclass(frozen=True)
class Acute:
    """An edge, or a corner of a CAD face, with a small angle.

    The scaled Jacobian of a hex with this angle is at most the sine of the angle.
    """

    kind: str  # "edge" (dihedral angle of the solid) or "corner" (angle of a face)
    # the adjacent CAD faces, or the face of the corner; (0, 0) without a CAD model
    faces: tuple[int, ...]
    place: tuple[float, ...]  # point with the smallest angle, in model units
    angle: float  # in radians


def acute(surface: TriMesh) -> list[Acute]:
    """Edges of the solid and corners of its CAD faces with angles below `SHARP`, in ascending
    order.

    surface : a closed surface; without CAD faces, folds of single triangles and corners are ignored
    """
    found = [*_edges(surface), *(_corners(surface) if len(surface.region) else ())]
    return sorted(found, key=lambda each: each.angle)


def _edges(surface: TriMesh) -> list[Acute]:
    goal, is_cad = target(surface), len(surface.region) > 0
    found = []
    for crease in goal.features.creases:
        least = int(crease.inside.argmin())
        is_fold = not is_cad and (crease.length < LONG or np.median(crease.inside) >= SHARP)
        if crease.inside[least] < SHARP and not is_fold:
            place = goal.to_model(crease.points[least : least + 2].mean(axis=0))
            faces = tuple(dict.fromkeys(crease.faces))
            found.append(Acute("edge", faces, tuple(place), float(crease.inside[least])))
    return found


def _corners(surface: TriMesh) -> list[Acute]:
    """Sharp corners of the CAD faces, at the corners of the features."""
    goal = target(surface)
    if not len(goal.features.corners):
        return []
    is_corner = cKDTree(goal.features.corners).query(goal.surface.vertices)[0] < SAME
    at = is_corner[surface.faces]  # (F, 3)
    region = np.broadcast_to(surface.region[:, None], at.shape)[at]
    each, of = np.unique(np.column_stack([region, surface.faces[at]]), axis=0, return_inverse=True)
    angle = np.bincount(of, corner_angles(surface)[at], len(each))
    return [
        Acute("corner", (int(face),), tuple(surface.vertices[vertex]), float(size))
        for (face, vertex), size in zip(each, angle, strict=True)
        if size < SHARP
    ]
