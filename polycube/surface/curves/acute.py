"""Edges and corners of a part that are sharper than a hex can follow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from polycube.surface.fit_target import target
from polycube.surface.measures import corner_angles
from polycube.types import TriMesh

SHARP = np.deg2rad(20)  # a hex that has such an angle has a scaled Jacobian below 0.35
LONG = 0.1  # diagonals, two hexes: shorter curves of triangles alone are folds of single ones
SAME = 1e-9  # of the diagonal: points nearer than this are one


@dataclass(frozen=True)
class Acute:
    """An edge, or a corner of a CAD face, with a small angle.

    A hex that has this angle has a scaled Jacobian of its sine at most.

    Parameters
    ----------
    kind : edge, where the angle is the solid's, or corner, where it is the face's
    faces : CAD faces that it is between, or of which it is the corner; (0, 0) without a CAD model
    place : where it is sharpest, in model units
    angle : in radians
    """

    kind: str
    faces: tuple[int, ...]
    place: tuple[float, ...]
    angle: float


def acute(surface: TriMesh) -> list[Acute]:
    """Edges of the solid and corners of its CAD faces below `SHARP`, the sharpest first.

    Parameters
    ----------
    surface : its edges are those of its features; without CAD faces folds of single triangles do
        not count, nor do corners
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
    """Of each CAD face at each corner of the features."""
    goal = target(surface)
    if not len(goal.features.corners):
        return []
    corners = cKDTree(goal.features.corners)
    is_corner = corners.query(goal.surface.vertices)[0] < SAME
    at = is_corner[surface.faces]  # (F, 3)
    sectors = np.column_stack(
        [np.broadcast_to(surface.region[:, None], at.shape)[at], surface.faces[at]]
    )
    each, of = np.unique(sectors, axis=0, return_inverse=True)
    angle = np.bincount(of, corner_angles(surface)[at], len(each))
    return [
        Acute("corner", (int(face),), tuple(surface.vertices[vertex]), float(size))
        for (face, vertex), size in zip(each, angle, strict=True)
        if size < SHARP
    ]
