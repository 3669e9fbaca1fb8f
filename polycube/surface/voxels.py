"""Voxels of a closed surface, by the parity of crossings along scan lines in z."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from polycube.surface.frames import turn
from polycube.types import TriMesh, freeze


@dataclass(frozen=True, eq=False)
class Voxels:
    """Solid voxels of a turned surface: voxel (i, j, k) fills origin + size * [ijk, ijk + 1]."""

    solid: np.ndarray  # (X, Y, Z) bool
    origin: np.ndarray  # (3,) in the turned frame
    size: float

    def __post_init__(self) -> None:
        freeze(self, solid=("X Y Z", bool), origin=("3", np.float64))

    def turned(self, rotation: np.ndarray) -> Voxels:
        """The same voxels in axes turned by one of the 24 rotations of the cube (3, 3)."""
        far = self.origin + self.size * np.array(self.solid.shape)
        origin = np.minimum(rotation @ self.origin, rotation @ far)
        return Voxels(turn(self.solid, rotation), origin, self.size)


def voxels(surface: TriMesh, rotation: np.ndarray, resolution: int) -> Voxels:
    """Voxels of the surface turned by a rotation (3, 3), `resolution` along the longest axis.

    A layer of empty voxels surrounds the solid.
    """
    points = surface.vertices @ rotation.T
    low, high = points.min(axis=0), points.max(axis=0)
    size = float((high - low).max() / resolution)
    shape = np.maximum(1, np.round((high - low) / size)).astype(int) + 2
    origin = (low + high) / 2 - shape * size / 2
    triangles = ((points - origin) / size)[surface.faces]
    return Voxels(_parity(triangles, *shape), origin, size)


@njit(cache=True)
def _parity(triangles: np.ndarray, nx: int, ny: int, nz: int) -> np.ndarray:
    """(nx, ny, nz) bool from (F, 3, 3) triangles in voxel units.

    Scan lines lie slightly off the voxel centres, so that they meet no vertex or edge of a part
    drawn on a grid.
    """
    crossed = np.zeros((nx, ny, nz + 1), np.bool_)
    off_x, off_y = 0.5 + 1.234e-5, 0.5 + 2.345e-5
    for t in range(len(triangles)):
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = triangles[t]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if abs(area) < 1e-14:
            continue
        for i in range(
            max(0, int(np.ceil(min(ax, bx, cx) - off_x))),
            min(nx - 1, int(np.floor(max(ax, bx, cx) - off_x))) + 1,
        ):
            for j in range(
                max(0, int(np.ceil(min(ay, by, cy) - off_y))),
                min(ny - 1, int(np.floor(max(ay, by, cy) - off_y))) + 1,
            ):
                px, py = i + off_x - ax, j + off_y - ay
                u = (px * (cy - ay) - py * (cx - ax)) / area
                v = ((bx - ax) * py - (by - ay) * px) / area
                if u >= 0 and v >= 0 and u + v <= 1:
                    k = int(np.ceil(az + u * (bz - az) + v * (cz - az) - 0.5))
                    crossed[i, j, min(max(k, 0), nz)] ^= True
    solid = np.zeros((nx, ny, nz), np.bool_)
    for i in range(nx):
        for j in range(ny):
            inside = False
            for k in range(nz):
                inside ^= crossed[i, j, k]
                solid[i, j, k] = inside
    return solid
