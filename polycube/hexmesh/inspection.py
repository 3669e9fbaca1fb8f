"""Temporary."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from polycube.hexmesh import quality as q
from polycube.hexmesh.crossings import crossings
from polycube.types import HexMesh, TriMesh


@dataclass(frozen=True, eq=False)
class Inspection:
    mesh: HexMesh
    surface: TriMesh

    @cached_property
    def _q(self):
        return q.quality(self.mesh, self.surface)

    @property
    def scaled_jacobian(self) -> float:
        return self._q.scaled_jacobian

    @property
    def deviation(self):
        return self._q.deviation

    @property
    def creases(self) -> float:
        return self._q.creases

    @property
    def volume_ratio(self) -> float:
        return self._q.volume_ratio

    @cached_property
    def crossings(self) -> np.ndarray:
        return crossings(self.mesh)

    @property
    def crossing_at(self):
        return self.mesh.vertices[self.mesh.quads[self.crossings[0, 0]]].mean(0)

    @property
    def largest(self) -> float:
        return max(self.deviation.to_surface.largest, self.deviation.to_mesh.largest)

    @property
    def farthest_at(self):
        return np.zeros(3)

    off_wall = 0.0
    off_size = 0.0
    lost_faces: tuple[str, ...] = ()


@lru_cache(maxsize=4)
def inspect(mesh: HexMesh, surface: TriMesh) -> Inspection:
    return Inspection(mesh, surface)
