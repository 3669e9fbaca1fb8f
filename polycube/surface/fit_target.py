"""The surface to fit: closest points with compatible normals, samples, creases.

All lengths are at unit scale (bounding box centred, diagonal 1), so weights have no units.
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from polycube.surface import closest, curved, measures
from polycube.surface.curves.creases import features
from polycube.surface.curves.cusps import without_cusps
from polycube.surface.curves.features import Features, divided_at_corners
from polycube.surface.filtered_normals import steady_normals
from polycube.types import TriMesh

ALPHA = 0.04  # weight of the difference of unit normals in closest points, a length in diagonals
FREE = 1.0  # squared difference of unit normals (60 degrees) without penalty
STEADY = 0.025  # half a hex: radius over which the normals of noisy faces are averaged


@dataclass(frozen=True, eq=False)
class Target:
    """A surface at unit scale, prepared for fitting."""

    center: np.ndarray  # (3,) centre of the bounding box of the model
    scale: float  # diagonal of the bounding box of the model
    surface: TriMesh  # at unit scale
    normals: np.ndarray  # (F, 3)
    vertex_normals: np.ndarray  # (V, 3)
    tree: closest.Tree  # of the surface, with its CAD faces as groups
    features: Features
    followed: Features  # for mesh edges: see `divided_at_corners` and `without_cusps`

    def to_unit(self, points: np.ndarray) -> np.ndarray:
        """Transform points of the model to unit scale."""
        return (points - self.center) / self.scale

    def to_model(self, points: np.ndarray) -> np.ndarray:
        """Transform points of unit scale to the units and the placement of the model."""
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
        """Closest points (N, 3) of points (N, 3) and their triangles (N,); see `closest.closest`.

        cad_face : (N,) CAD face on which each closest point must lie; 0 for any face
        """
        return closest.closest(self.tree, points, normals, alpha, guess, free, cad_face)[:2]

    def smooth(self, points: np.ndarray, face: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points and unit normals (N, 3) of the CAD faces for points (N, 3) of triangles (N,).

        Other surfaces are not changed; see `polycube.surface.curved`.
        """
        if not len(self.surface.region):
            return points, self.normals[face]
        corners = self.surface.vertices[self.surface.faces[face]]
        return curved.lifted(points, corners, self._corner_normals[face])

    @cached_property
    def _corner_normals(self) -> np.ndarray:
        return curved.corner_normals(self.surface, self.normals)

    @property
    def volume(self) -> float:
        """Volume inside the smooth CAD faces, in the units of the model.

        The mean of a quadratic offset over a triangle is 3/4 of that at its centroid.
        """
        middles = self.surface.vertices[self.surface.faces].mean(axis=1)
        shift = self.smooth(middles, np.arange(len(middles)))[0] - middles
        more = 3 / 4 * float(np.vdot(measures.area_vectors(self.surface), shift))
        return (measures.volume(self.surface) + more) * self.scale**3

    def samples(self, number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """About `number` evenly spread points (N, 3), their normals (N, 3) and CAD faces (N,)."""
        return _samples(self, number)


@lru_cache(maxsize=4)
def target(surface: TriMesh) -> Target:
    """Prepare a surface; the result is cached for each surface object."""
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    center, scale = (low + high) / 2, measures.diagonal(surface)
    small = replace(surface, vertices=(surface.vertices - center) / scale)
    normals = measures.face_normals(small)
    graph = features(small, normals)
    normals = steady_normals(small, normals, graph.noise, STEADY)
    by_vertex = np.zeros_like(small.vertices)
    weighted = normals * measures.face_areas(small)[:, None]
    for k in range(3):
        np.add.at(by_vertex, small.faces[:, k], weighted)
    region = small.region if len(small.region) else None
    tree = closest.tree(small.vertices[small.faces], normals, region)
    followed = without_cusps(divided_at_corners(graph))
    return Target(center, scale, small, normals, measures.unit(by_vertex), tree, graph, followed)


@lru_cache(maxsize=16)
def _samples(target: Target, number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    points, face = measures.spread(target.surface, number)
    region = target.surface.region
    cad_face = region[face] if len(region) else np.zeros(len(face), np.int64)
    return points, target.normals[face], cad_face
