"""Voxels of a closed surface; points are inside by parity or by winding number."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numba import njit

from polycube.surface.frames import turn
from polycube.types import TriMesh
from polycube.types.checks import Arrays

# of a spacing: offset of the scan lines, so that they meet no edge of a part on the grid
OFF = 1.234e-5, 2.345e-5


@dataclass(frozen=True, eq=False)
class Voxels(Arrays):
    """Solid voxels of a rotated surface: voxel (i, j, k) fills origin + size * [ijk, ijk + 1]."""

    solid: Annotated[np.ndarray, "X Y Z bool"]
    origin: Annotated[np.ndarray, "3"]  # in the rotated frame
    size: float

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


def inside(triangles: np.ndarray, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Test which points of a grid are inside a closed surface.

    Returns (X, Y, Z) bool.

    triangles : (F, 3, 3) corners of a closed surface
    x, y, z : (X,), (Y,), (Z,) coordinates, ascending
    """
    x, y = (
        at + off * (np.append(np.diff(at), at[-1] - at[-2]) if len(at) > 1 else 1.0)
        for at, off in zip((x, y), OFF, strict=True)
    )
    crossed = _crossed(np.ascontiguousarray(triangles), x, y, z)
    return np.logical_xor.accumulate(crossed, axis=2)[:, :, :-1]


@njit(cache=True)
def _crossed(triangles: np.ndarray, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """(X, Y, Z + 1) parity of the intersections of each line (x, y) that first lie below each z."""
    crossed = np.zeros((len(x), len(y), len(z) + 1), np.bool_)
    for t in range(len(triangles)):
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = triangles[t]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if abs(area) < 1e-14 * (abs(bx - ax) + abs(cy - ay) + abs(by - ay) + abs(cx - ax)) ** 2:
            continue
        first = np.searchsorted(x, min(ax, bx, cx))
        after = np.searchsorted(x, max(ax, bx, cx), side="right")
        low = np.searchsorted(y, min(ay, by, cy))
        high = np.searchsorted(y, max(ay, by, cy), side="right")
        for i in range(first, after):
            for j in range(low, high):
                px, py = x[i] - ax, y[j] - ay
                u = (px * (cy - ay) - py * (cx - ax)) / area
                v = ((bx - ax) * py - (by - ay) * px) / area
                if u >= 0 and v >= 0 and u + v <= 1:
                    crossed[i, j, np.searchsorted(z, az + u * (bz - az) + v * (cz - az))] ^= True
    return crossed


def winding_numbers(surface: TriMesh, points: np.ndarray) -> np.ndarray:
    """(N,) winding numbers of the surface at points (N, 3), within about 0.01."""
    import igl

    return igl.fast_winding_number(surface.vertices, surface.faces, points)
