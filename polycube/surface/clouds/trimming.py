"""Parts of a reconstructed surface that no points are near, and what to put in their place.

A triangulation of such a hole crosses the surface where the hole's edge is ragged, so it only gives
points, for a second reconstruction.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from polycube.surface.closest import closest, tree
from polycube.surface.clouds.points import Cloud, spacings
from polycube.surface.measures import components, face_areas, face_normals
from polycube.surface.repair.holes import MAX_LOOP, filling, loops
from polycube.surface.samples import spread
from polycube.types import TriMesh

PIECE = 0.01  # of the points: a piece of the surface with no more of them is left out
RIM = 0.5  # of `points.trim`: how near to the points the surface is removed around such a part


def supported(surface: TriMesh, cloud: Cloud) -> TriMesh:
    """The pieces that have some of the points."""
    piece = components(surface.faces)
    corners = surface.vertices[surface.faces]
    nearest = closest(tree(corners, np.zeros((len(corners), 3))), cloud.points)[1]
    number = np.bincount(piece[nearest], minlength=piece.max() + 1)
    kept = (number > PIECE * len(cloud.points))[piece]
    used, faces = np.unique(surface.faces[kept], return_inverse=True)
    return TriMesh(surface.vertices[used], faces.reshape(-1, 3))


def fillings(surface: TriMesh, cloud: Cloud, spacing: float, trim: float) -> tuple[Cloud, float]:
    """Points for the parts of a surface that are farther from the points than so many spacings.

    They lie, as dense as the cloud, on the triangulations of least area that close the holes which
    such parts leave, and have the normals of these.

    Returns
    -------
    The points, none where there is no such part or its hole is too long, and the share of its area.
    """
    none = Cloud(np.zeros((0, 3)), np.zeros((0, 3)))
    away, nearest = cKDTree(cloud.points).query(surface.vertices)
    far = _far(surface.faces, away / np.maximum(spacings(cloud.points)[nearest], spacing), trim)
    if not far.any() or far.all():
        return none, float(far.all())
    area = face_areas(surface)
    share = float(area[far].sum() / area.sum())
    left = supported(TriMesh(surface.vertices, surface.faces[~far]), cloud)
    edges = loops(left.faces)
    if not edges or max(map(len, edges)) > MAX_LOOP:
        return none, share
    faces = [loop[filling(left.vertices[loop])] for loop in edges]
    cover = TriMesh(left.vertices, np.concatenate(faces))
    points, face = spread(cover, int(np.ceil(face_areas(cover).sum() / spacing**2)))
    return Cloud(points, face_normals(cover)[face]), share


def _far(faces: np.ndarray, away: np.ndarray, trim: float) -> np.ndarray:
    """(F,) faces to remove: those farther than `trim`, and around them those nearly as far.

    away : (V,) distance of each vertex from the points, in spacings
    """
    wide = np.flatnonzero((away > RIM * trim)[faces].any(axis=1))
    region = components(faces[wide])
    beyond = (away > trim)[faces[wide]].any(axis=1)
    far = np.zeros(len(faces), dtype=bool)
    far[wide[np.isin(region, region[beyond])]] = True
    return far
