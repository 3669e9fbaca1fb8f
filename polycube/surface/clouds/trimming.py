"""Regions of a reconstructed surface without points, and points to fill them.

A triangulation of such a hole can cross the surface if the boundary of the hole is ragged.
Therefore only points on it are used, for a second reconstruction.
"""

import numpy as np
from scipy.spatial import cKDTree

from polycube.surface.closest import closest, tree
from polycube.surface.clouds.points import Cloud, spacings
from polycube.surface.measures import components, face_areas, face_normals, spread
from polycube.surface.repair.clean import compact
from polycube.surface.repair.holes import MAX_LOOP, filling, loops
from polycube.types import TriMesh

PIECE = 0.01  # smallest share of the points for a component of the surface
RIM = 0.5  # distance at which the rim of a region is removed, as a share of `points.trim`


def supported(surface: TriMesh, cloud: Cloud) -> TriMesh:
    """The components of the surface that have at least a share `PIECE` of the points."""
    piece = components(surface.faces)
    nearest = closest(tree(surface.vertices[surface.faces]), cloud.points)[1]
    number = np.bincount(piece[nearest], minlength=piece.max() + 1)
    is_supported = (number > PIECE * len(cloud.points))[piece]
    return compact(surface.vertices, surface.faces[is_supported])


def fillings(surface: TriMesh, cloud: Cloud, spacing: float, trim: float) -> tuple[Cloud, float]:
    """Points that fill the regions of a surface that are far from the cloud.

    The regions are removed, and their holes are closed by triangulations of least area. The points
    lie on these, with their normals and with the density of the cloud.

    Parameters
    ----------
    trim
        Distance from the cloud above which a region is removed, in spacings.

    Returns
    -------
    points
        Empty if there is no such region, or if a hole is too long.
    share
        Share of the area of the removed regions.
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
    """(F,) whether a face is removed: it is farther than `trim`, or at the rim of such faces.

    away : (V,) distance of each vertex from the points, in spacings
    """
    wide = np.flatnonzero((away > RIM * trim)[faces].any(axis=1))
    region = components(faces[wide])
    beyond = (away > trim)[faces[wide]].any(axis=1)
    far = np.zeros(len(faces), dtype=bool)
    far[wide[np.isin(region, region[beyond])]] = True
    return far
