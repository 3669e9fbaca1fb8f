"""Poisson reconstruction of a closed surface from points.

The method is that of Kazhdan and Hoppe, *Screened Poisson surface reconstruction*, ACM Transactions
on Graphics 32 (2013), as implemented by open3d. It runs on one thread, so that the result is
reproducible. In regions without points the surface bulges or stays open. Therefore such regions are
filled with points on a triangulation of least area, and the surface is reconstructed again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from polycube.errors import InputError
from polycube.surface.closest import closest, distance, tree
from polycube.surface.clouds import points
from polycube.surface.clouds.options import Points
from polycube.surface.measures import diagonal, face_normals, is_closed, spread, volume
from polycube.types import TriMesh

NEIGHBOURS = 30, 12, 60  # tried in sequence: more for noise, fewer for thin walls
AGREE = 0.98  # share of normals consistent with the surface at which it is accepted at once
DISAGREE = 0.9  # smallest share of consistent normals
NEAR = 3.0  # largest distance of a point on the surface, in spacings
MARGIN = 1.2  # width of the grid divided by that of the cloud
DEPTHS = 5, 8  # range of the depth of the grid, if none is given
SAMPLES = 20_000  # number of points on the surface for the distance from the cloud


@dataclass(frozen=True)
class Reconstruction:
    """Numbers of a reconstruction, as in `report.json`; lengths are in the units of the file."""

    given: int  # number of points in the file
    dropped: int  # number of points that are not finite or duplicates
    outliers: int  # number of outliers that were removed
    spacing: float  # median of the spacings of the points
    neighbours: int | None  # for estimated normals; None: normals of the file
    normals_agree: float  # share of the normals that are consistent with the surface
    cell: float  # width of the cells of the grid
    made_up: float  # share of the area without points nearby
    added: int  # number of points that were added there
    deviation_mean: float  # distances of the points, without outliers, from the surface
    deviation_p95: float
    deviation_max: float
    deviation_max_percent: float  # of the diagonal
    farthest: float  # largest distance of the surface from the points

    def sentence(self) -> str:
        """Summary in one sentence."""
        left = [f"{self.outliers} outliers"] * (self.outliers > 0)
        left += [f"{self.dropped} invalid or duplicate points"] * (self.dropped > 0)
        without = f" without {' and '.join(left)}" if left else ""
        closed = f"; {100 * self.made_up:.2g} % of its area had no points and was closed"
        filled = closed if self.added else ""
        return (
            f"surface reconstructed from {self.given} points{without}, on cells of "
            f"{self.cell:.3g}: points deviate by {self.deviation_mean:.3g} on average, "
            f"{self.deviation_max:.3g} at most ({self.deviation_max_percent:.2g} % of the "
            f"diagonal){filled}"
        )


def reconstruct(given: points.Cloud, options: Points) -> tuple[TriMesh, Reconstruction]:
    """Closed surface of points, with triangles that face outwards.

    Raises InputError if the points do not bound a solid, or if their normals cannot be oriented.
    """
    cloud = distinct = points.checked(given)
    if options.outliers is not None:
        cloud = points.without_outliers(cloud, options.outliers)
    spacing = float(np.median(points.spacings(cloud.points)))
    width, depth = MARGIN * float(np.ptp(cloud.points, axis=0).max()), options.depth  # of the grid
    if depth is None:
        depth = int(np.clip(np.round(np.log2(width / spacing)), *DEPTHS))
    cell = width / 2**depth
    thinned = points.averaged(cloud, cell / 2) if spacing < cell / 2 else cloud
    made = _oriented(thinned, options.neighbours, depth, NEAR * spacing)
    surface, agree = made.surface, made.agree
    if agree < DISAGREE:
        follows = f"the surface follows only {100 * agree:.0f} % of the normals of the points"
        why = f"the sides of its walls cannot be told apart at a spacing of {spacing:.3g}"
        remedy = "scan more densely, or give the normals in a PLY or PCD file"
        raise InputError(f"{follows}: {why}", remedy=remedy)
    share, added = 0.0, 0
    if options.trim is not None:
        more, share = points.fillings(surface, cloud, max(spacing, cell / 2), options.trim)
        added = len(more.points)
        surface = _poisson(made.cloud.joined(more), depth) if added else surface
    if not is_closed(surface.faces):
        what = "the points leave so much of the surface open that it could not be closed"
        raise InputError(what, remedy="scan the missing parts too")
    if volume(surface) < 0:
        surface = TriMesh(surface.vertices, surface.faces[:, ::-1])
    away = distance(tree(surface.vertices[surface.faces]), cloud.points)
    return surface, Reconstruction(
        given=len(given.points),
        dropped=len(given.points) - len(distinct.points),
        outliers=len(distinct.points) - len(cloud.points),
        spacing=spacing,
        neighbours=made.neighbours,
        normals_agree=agree,
        cell=cell,
        made_up=share,
        added=added,
        deviation_mean=float(away.mean()),
        deviation_p95=float(np.quantile(away, 0.95)),
        deviation_max=float(away.max()),
        deviation_max_percent=100 * float(away.max()) / diagonal(surface),
        farthest=float(cKDTree(cloud.points).query(spread(surface, SAMPLES)[0])[0].max()),
    )


@dataclass(frozen=True)
class _Oriented:
    """A cloud with normals, and the surface reconstructed from it."""

    cloud: points.Cloud
    surface: TriMesh
    agree: float  # share of the normals that are consistent with the surface
    neighbours: int | None = None  # for estimated normals

    @classmethod
    def of(
        cls, cloud: points.Cloud, depth: int, reach: float, neighbours: int | None = None
    ) -> _Oriented:
        """The reconstruction; normals count at points within a distance of the surface."""
        surface = _poisson(cloud, depth)
        normals = face_normals(surface)
        feet, face, _ = closest(tree(surface.vertices[surface.faces], normals), cloud.points)
        near = np.linalg.norm(feet - cloud.points, axis=1) < reach
        along = np.einsum("ni,ni->n", normals[face], cloud.normals) > 0
        agree = float(max((near & along).mean(), (near & ~along).mean()))
        return cls(cloud, surface, agree, neighbours)


def _oriented(cloud: points.Cloud, neighbours: int | None, depth: int, reach: float) -> _Oriented:
    """The first reconstruction with consistent normals, otherwise the best of all."""
    if len(cloud.normals):
        return _Oriented.of(cloud, depth, reach)
    found = []
    for number in NEIGHBOURS if neighbours is None else (neighbours,):
        found.append(_Oriented.of(points.with_normals(cloud, number), depth, reach, number))
        if found[-1].agree > AGREE:
            return found[-1]
    return max(found, key=lambda each: each.agree)


def _poisson(cloud: points.Cloud, depth: int) -> TriMesh:
    """Poisson surface of oriented points; InputError if there is none."""
    from open3d.geometry import TriangleMesh

    made = TriangleMesh.create_from_point_cloud_poisson(
        points.as_open3d(cloud), depth=depth, scale=MARGIN, n_threads=1
    )[0]
    faces = np.array(made.triangles, dtype=np.int64).reshape(-1, 3)
    if not len(faces):
        raise InputError("the points lie on no surface")
    return points.supported(TriMesh(np.array(made.vertices), faces), cloud)
