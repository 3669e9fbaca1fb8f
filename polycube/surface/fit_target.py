"""The surface to fit: closest points with compatible normals, samples, creases.

Works at unit scale (bounding box centred, diagonal 1), so that weights need no units.
"""

from __future__ import annotations

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
class Target:
    """A surface at unit scale, prepared for fitting."""

    center: np.ndarray  # (3,) of the model's bounding box
    scale: float  # diagonal of the model's bounding box
    surface: TriMesh  # at unit scale
    normals: np.ndarray  # (F, 3)
    vertex_normals: np.ndarray  # (V, 3)
    trees: closest.Forest  # of the surface and of its CAD faces
    features: Features
    followed: Features  # the curves that mesh edges are to follow: see `without_cusps`

    @property
    def tree(self) -> closest.Tree:
        """Of the whole surface."""
        return self.trees.tree

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
        how = points, normals, alpha, guess, free
        if cad_face is None:
            return closest.closest(self.tree, *how)[:2]
        return closest.closest_in(self.trees, cad_face, *how)[:2]

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
    region = unit.region if len(unit.region) else np.zeros(len(unit.faces), np.int64)
    trees = closest.forest(unit.vertices[unit.faces], normals, region)
    return Target(center, scale, unit, normals, by_vertex, trees, graph, without_cusps(graph))


@lru_cache(maxsize=16)
def _samples(target: Target, number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    points, face = spread(target.surface, number)
    region = target.surface.region
    cad_face = region[face] if len(region) else np.zeros(len(face), np.int64)
    return points, target.normals[face], cad_face
