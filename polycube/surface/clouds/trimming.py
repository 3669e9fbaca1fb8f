"""Remove the parts of a reconstructed surface that no points are near, and close the holes."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from polycube.surface.closest import closest, tree
from polycube.surface.clouds.points import Cloud, spacings
from polycube.surface.intersections import self_intersections
from polycube.surface.measures import components, face_areas, is_closed
from polycube.surface.repair.holes import MAX_LOOP, filling, loops
from polycube.types import TriMesh

PIECE = 0.01  # of the points: a piece of the surface with no more of them is left out
RIM = 0.5  # of `points.trim`: how near to the points the surface is removed around such a part
ROUNDS = 20  # of smoothing the edge of a hole


def supported(surface: TriMesh, cloud: Cloud) -> TriMesh:
    """The pieces that have some of the points."""
    piece = components(surface.faces)
    corners = surface.vertices[surface.faces]
    nearest = closest(tree(corners, np.zeros((len(corners), 3))), cloud.points)[1]
    number = np.bincount(piece[nearest], minlength=piece.max() + 1)
    kept = (number > PIECE * len(cloud.points))[piece]
    used, faces = np.unique(surface.faces[kept], return_inverse=True)
    return TriMesh(surface.vertices[used], faces.reshape(-1, 3))


def trimmed(
    surface: TriMesh, cloud: Cloud, spacing: float, trim: float
) -> tuple[TriMesh, float, bool]:
    """Close a surface anew where it is farther from the points than so many spacings.

    Returns
    -------
    The surface, the share of that area, and whether it was closed anew: it stays as it is where the
    holes cannot be closed without faces that cross.
    """
    away, nearest = cKDTree(cloud.points).query(surface.vertices)
    far = _far(surface.faces, away / np.maximum(spacings(cloud.points)[nearest], spacing), trim)
    if not far.any() or far.all():
        return surface, float(far.all()), False
    area = face_areas(surface)
    share = float(area[far].sum() / area.sum())
    left = supported(TriMesh(surface.vertices, surface.faces[~far]), cloud)
    for loop in loops(left.faces):
        if len(loop) > MAX_LOOP:
            return surface, share, False
        left = _covered(left, loop)
    if not is_closed(left.faces) or len(self_intersections(left)):
        return surface, share, False
    return left, share, True


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


def _covered(surface: TriMesh, loop: np.ndarray) -> TriMesh:
    """Close the hole inside a loop of vertices.

    Its ragged edge gets a strip of faces to a smooth copy of it, and this the triangulation of
    least area, none of whose edges can be one of the surface.
    """
    ring = surface.vertices[loop]
    for _ in range(ROUNDS):
        ring = (np.roll(ring, 1, axis=0) + 2 * ring + np.roll(ring, -1, axis=0)) / 4
    copy = len(surface.vertices) + np.arange(len(loop))
    after, copy_after = np.roll(loop, -1), np.roll(copy, -1)
    strip = [np.stack(f, axis=1) for f in ((loop, after, copy_after), (loop, copy_after, copy))]
    faces = np.concatenate([surface.faces, *strip, copy[filling(ring)]])
    return TriMesh(np.concatenate([surface.vertices, ring]), faces)
