"""The surface to fit: closest points with compatible normals, samples, creases.

Works at unit scale (bounding box centred, diagonal 1), so that weights need no units.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from polycube.surface import closest
from polycube.surface.curves.creases import features
from polycube.surface.curves.cusps import without_cusps
from polycube.surface.curves.features import Features
from polycube.surface.filtered_normals import steady_normals
from polycube.surface.measures import diagonal, face_areas, face_normals
from polycube.surface.samples import spread
from polycube.types import TriMesh

STEADY = 0.025  # half a hex: radius of the mean by which noisy faces look


@dataclass(frozen=True, eq=False)
class Chart:
    """Triangles of one CAD face, prepared for closest points."""

    triangles: np.ndarray  # (T,) of the whole surface
    local: np.ndarray  # (F,) place in these of each triangle of the surface; 0 for others
    tree: closest.Tree


@dataclass(frozen=True, eq=False)
class Target:
    """A surface at unit scale, prepared for fitting."""

    center: np.ndarray  # (3,) of the model's bounding box
    scale: float  # diagonal of the model's bounding box
    surface: TriMesh  # at unit scale
    normals: np.ndarray  # (F, 3)
    vertex_normals: np.ndarray  # (V, 3)
    tree: closest.Tree
    features: Features
    followed: Features  # the curves that mesh edges are to follow: see `without_cusps`
    charts: Mapping[int, Chart]  # by CAD face; 0 is the whole surface; none without CAD faces

    def to_unit(self, points: np.ndarray) -> np.ndarray:
        """Model points at unit scale."""
        return (points - self.center) / self.scale

    def to_model(self, points: np.ndarray) -> np.ndarray:
        """Points of unit scale in the user's units and placement."""
        return points * self.scale + self.center

    def closest(
        self,
        points: np.ndarray,
        normals: np.ndarray | None = None,
        alpha: float = 0.0,
        guess: np.ndarray | None = None,
        free: float = 0.0,
        cad_face: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Feet (N, 3) of points (N, 3) and their triangles (N,); see `closest.closest`.

        cad_face : (N,) the face of the CAD model that each foot must be on; 0 for any
        """
        if cad_face is None or not self.charts:
            foot, face, _ = closest.closest(self.tree, points, normals, alpha, guess, free)
            return foot, face
        feet, faces = np.empty_like(points), np.empty(len(points), np.int64)
        for number in np.unique(cad_face).tolist():
            here = np.flatnonzero(cad_face == number)
            chart = self.charts[number]
            facing = None if normals is None else normals[here]
            start = None if guess is None else chart.local[guess[here]]
            feet[here], own, _ = closest.closest(
                chart.tree, points[here], facing, alpha, start, free
            )
            faces[here] = chart.triangles[own]
        return feet, faces

    def samples(self, number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """About `number` points (N, 3) spread evenly, with normals (N, 3) and CAD faces (N,)."""
        return _samples(self, number)


@lru_cache(maxsize=4)
def target(surface: TriMesh) -> Target:
    """Prepare a surface; the same object gives the same Target."""
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    center, scale = (low + high) / 2, diagonal(surface)
    unit = TriMesh((surface.vertices - center) / scale, surface.faces, surface.region)
    normals = face_normals(unit)
    graph = features(unit, normals)
    normals = steady_normals(unit, normals, graph.noise, STEADY)
    by_vertex = np.zeros_like(unit.vertices)
    weighted = normals * face_areas(unit)[:, None]
    for k in range(3):
        np.add.at(by_vertex, unit.faces[:, k], weighted)
    by_vertex /= np.maximum(np.linalg.norm(by_vertex, axis=1, keepdims=True), 1e-30)
    tree = closest.tree(unit.vertices[unit.faces], normals)
    charts, followed = _charts(unit, normals, tree), without_cusps(graph)
    return Target(center, scale, unit, normals, by_vertex, tree, graph, followed, charts)


def _charts(unit: TriMesh, normals: np.ndarray, whole: closest.Tree) -> dict[int, Chart]:
    """One for each CAD face, and the whole surface under 0."""
    if not len(unit.region):
        return {}
    every = np.arange(len(unit.faces))
    charts = {0: Chart(every, every, whole)}
    for number in np.unique(unit.region).tolist():
        own = np.flatnonzero(unit.region == number)
        local = np.zeros(len(unit.faces), np.int64)
        local[own] = np.arange(len(own))
        tree = closest.tree(unit.vertices[unit.faces[own]], normals[own])
        charts[number] = Chart(own, local, tree)
    return charts


@lru_cache(maxsize=16)
def _samples(target: Target, number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    points, face = spread(target.surface, number)
    region = target.surface.region
    cad_face = region[face] if len(region) else np.zeros(len(face), np.int64)
    return points, target.normals[face], cad_face
