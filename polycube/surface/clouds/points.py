"""Point clouds: validation, outliers, estimation of oriented normals, filling of empty regions.

A triangulation of the hole of such a region can cross the surface if the boundary of the hole is
ragged. Therefore only points on it are used, for a second reconstruction.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated

import numpy as np
from scipy.spatial import cKDTree

from polycube.errors import InputError, MissingPackage
from polycube.surface.closest import closest, tree
from polycube.surface.measures import components, face_areas, face_normals, spread
from polycube.surface.repair.clean import compact
from polycube.surface.repair.holes import MAX_LOOP, filling, loops
from polycube.types import TriMesh
from polycube.types.checks import Arrays

if TYPE_CHECKING:
    from open3d.geometry import PointCloud

FEWEST = 100  # smallest number of points
FLAT = 1e-3  # smallest width of a cloud that bounds a solid, as a share of its length
RING = 6  # number of nearest points whose mean distance is the spacing at a point
LINKS = 10  # number of nearest points of a point in the graph that orients normals
DIAGONALS = 1e-30, 1e30  # range of the diagonal of a cloud
PIECE = 0.01  # smallest share of the points for a component of the surface
RIM = 0.5  # distance at which the rim of a region is removed, as a share of `points.trim`


@dataclass(frozen=True, eq=False)
class Cloud(Arrays):
    """Points on a surface, in the units of the file; `normals` is (0, 3) if they are unknown."""

    points: Annotated[np.ndarray, "N 3"]
    normals: Annotated[np.ndarray, "N? 3"]  # unit, or (0, 3)

    def taken(self, chosen: np.ndarray) -> Cloud:
        """The points that are selected by indices or by a mask."""
        normals = self.normals[chosen] if len(self.normals) else self.normals
        return Cloud(self.points[chosen], normals)

    def joined(self, other: Cloud) -> Cloud:
        """The points of both clouds; either both have normals or neither has."""
        points = np.concatenate([self.points, other.points])
        return Cloud(points, np.concatenate([self.normals, other.normals]))


def checked(cloud: Cloud) -> Cloud:
    """Finite and distinct points, with unit normals if all of them have a normal.

    Raises InputError if there are too few points, or all of them lie on a line or in a plane.
    """
    finite = np.isfinite(cloud.points).all(axis=1)
    _, first = np.unique(cloud.points[finite], axis=0, return_index=True)
    left = cloud.taken(np.flatnonzero(finite)[np.sort(first)])
    number = len(left.points)
    if number < FEWEST:
        strange = f", {(~finite).sum()} are not finite" if not finite.all() else ""
        what = f"the cloud has {number} distinct points (of {len(cloud.points)}{strange})"
        raise InputError(what, remedy=f"a surface needs {FEWEST} at least")
    size = float(np.hypot.reduce(np.ptp(left.points, axis=0)))
    if not DIAGONALS[0] < size < DIAGONALS[1]:
        raise InputError(f"the cloud's diagonal of {size:.3g} is out of range; scale it to about 1")
    widths = np.linalg.svd(left.points - left.points.mean(axis=0), compute_uv=False)
    if widths[2] < FLAT * widths[0]:
        where = "on one line" if widths[1] < FLAT * widths[0] else "in one plane"
        raise InputError(f"all points of the cloud lie {where}, so they bound no solid")
    lengths = np.linalg.norm(left.normals, axis=1, keepdims=True)
    if not (np.isfinite(lengths) & (lengths > 0)).all():
        return replace(left, normals=np.zeros((0, 3)))
    return replace(left, normals=left.normals / lengths)


def spacings(points: np.ndarray) -> np.ndarray:
    """(N,) mean distance of each point from its nearest points."""
    return cKDTree(points).query(points, RING + 1)[0][:, 1:].mean(axis=1)


def without_outliers(cloud: Cloud, deviations: float) -> Cloud:
    """Remove points whose spacing exceeds the mean by a number of standard deviations.

    This is done twice, because far outliers hide near ones.
    """
    for _ in range(2):
        away = spacings(cloud.points)
        cloud = cloud.taken(away <= away.mean() + deviations * away.std())
    return cloud


def averaged(cloud: Cloud, cell: float) -> Cloud:
    """Cloud with one point, the mean, for each cell of a grid that contains points."""
    return _cloud(as_open3d(cloud).voxel_down_sample(cell))


def with_normals(cloud: Cloud, neighbours: int) -> Cloud:
    """Estimate normals from planes through the nearest points, and orient them consistently."""
    from open3d.geometry import KDTreeSearchParamKNN

    made = as_open3d(cloud)
    made.estimate_normals(KDTreeSearchParamKNN(neighbours))
    made.orient_normals_consistent_tangent_plane(min(LINKS, neighbours))
    return _cloud(made)


def as_open3d(cloud: Cloud) -> PointCloud:
    """Cloud of open3d; MissingPackage if open3d does not load."""
    try:
        from open3d.geometry import PointCloud
        from open3d.utility import Vector3dVector
    except (ImportError, OSError) as error:
        raise without_open3d("point clouds need", error) from error
    made = PointCloud(Vector3dVector(cloud.points.copy()))
    if len(cloud.normals):
        made.normals = Vector3dVector(cloud.normals.copy())
    return made


def without_open3d(needed: str, why: object) -> MissingPackage:
    """Error for a file that needs open3d, if it does not load."""
    return MissingPackage(
        f"{needed} open3d, which does not load ({why}); on Debian or Ubuntu: "
        "apt-get install libusb-1.0-0 libgl1 libegl1 libx11-6"
    )


def _cloud(made: PointCloud) -> Cloud:
    return Cloud(np.array(made.points), np.array(made.normals).reshape(-1, 3))


def supported(surface: TriMesh, cloud: Cloud) -> TriMesh:
    """The components of the surface that have at least a share `PIECE` of the points."""
    piece = components(surface.faces)
    nearest = closest(tree(surface.vertices[surface.faces]), cloud.points)[1]
    number = np.bincount(piece[nearest], minlength=piece.max() + 1)
    return compact(surface.vertices, surface.faces[(number > PIECE * len(cloud.points))[piece]])


def fillings(surface: TriMesh, cloud: Cloud, spacing: float, trim: float) -> tuple[Cloud, float]:
    """Points that fill the regions of a surface that are far from the cloud.

    The regions are removed, and their holes are closed by triangulations of least area. The points
    lie on these, with their normals and with the density of the cloud. There are none if there is
    no such region, or if a hole is too long. Also returns the removed share of the area.

    trim : distance from the cloud above which a region is removed, in spacings
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
