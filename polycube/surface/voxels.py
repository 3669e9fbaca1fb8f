"""Voxels of a closed surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polycube.surface.frames import turn
from polycube.surface.inside import inside
from polycube.types import TriMesh, freeze


@dataclass(frozen=True, eq=False)
class Voxels:
    """Solid voxels of a rotated surface: voxel (i, j, k) fills origin + size * [ijk, ijk + 1]."""

    solid: np.ndarray  # (X, Y, Z) bool
    origin: np.ndarray  # (3,) in the rotated frame
    size: float

    def __post_init__(self) -> None:
        freeze(self, solid="X Y Z bool", origin="3")

    def turned(self, rotation: np.ndarray) -> Voxels:
        """The same voxels in axes rotated by one of the 24 rotations of the cube (3, 3)."""
        far = self.origin + self.size * np.array(self.solid.shape)
        origin = np.minimum(rotation @ self.origin, rotation @ far)
        return Voxels(turn(self.solid, rotation), origin, self.size)


def voxels(surface: TriMesh, rotation: np.ndarray, resolution: int) -> Voxels:
    """Voxels of the surface after a rotation (3, 3), `resolution` along the longest axis.

    The solid is surrounded by a layer of empty voxels.
    """
    points = surface.vertices @ rotation.T
    low, high = points.min(axis=0), points.max(axis=0)
    size = float((high - low).max() / resolution)
    shape = np.maximum(1, np.round((high - low) / size)).astype(int) + 2
    origin = (low + high) / 2 - shape * size / 2
    triangles = ((points - origin) / size)[surface.faces]
    return Voxels(inside(triangles, *(np.arange(n) + 0.5 for n in shape)), origin, size)
