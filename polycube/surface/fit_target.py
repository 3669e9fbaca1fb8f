"""The surface to fit: closest points with compatible normals, samples, creases.

Works at unit scale (bounding box centred, diagonal 1), so that weights need no units.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from polycube.surface import closest
from polycube.surface.creases import Features, features
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
    tree: closest.Tree
    features: Features

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
    ) -> tuple[np.ndarray, np.ndarray]:
        """Feet (N, 3) of points (N, 3) and their faces (N,); see `closest.closest`."""
        foot, face, _ = closest.closest(self.tree, points, normals, alpha, guess, free)
        return foot, face

    def samples(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """About `number` points (N, 3) spread evenly by area, with normals (N, 3)."""
        return _samples(self, number)


@lru_cache(maxsize=4)
def target(surface: TriMesh) -> Target:
    """Prepare a surface; the same object gives the same Target."""
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    center, scale = (low + high) / 2, diagonal(surface)
    unit = TriMesh((surface.vertices - center) / scale, surface.faces)
    normals = face_normals(unit)
    graph = features(unit, normals)
    normals = steady_normals(unit, normals, graph.noise, STEADY)
    by_vertex = np.zeros_like(unit.vertices)
    weighted = normals * face_areas(unit)[:, None]
    for k in range(3):
        np.add.at(by_vertex, unit.faces[:, k], weighted)
    by_vertex /= np.maximum(np.linalg.norm(by_vertex, axis=1, keepdims=True), 1e-30)
    tree = closest.tree(unit.vertices[unit.faces], normals)
    return Target(center, scale, unit, normals, by_vertex, tree, graph)


@lru_cache(maxsize=16)
def _samples(target: Target, number: int) -> tuple[np.ndarray, np.ndarray]:
    points, face = spread(target.surface, number)
    return points, target.normals[face]
