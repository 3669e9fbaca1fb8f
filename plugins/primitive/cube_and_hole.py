"""The unit cells of the paper: a cube, and a cube with a square through hole along one axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polycube.registry import register


@register("primitive", "cube")
@dataclass(frozen=True)
class Cube:
    """A full cell."""

    def __call__(self) -> np.ndarray:
        """(3, 3, 3) bool voxels."""
        return np.ones((3, 3, 3), bool)


def _hole(axis: int) -> np.ndarray:
    """(3, 3, 3) bool voxels without the central row along one axis."""
    voxels = np.ones((3, 3, 3), bool)
    np.moveaxis(voxels, axis, 2)[1, 1] = False
    return voxels


@register("primitive", "hole_x")
@dataclass(frozen=True)
class HoleX:
    """A cell with a square through hole along x."""

    def __call__(self) -> np.ndarray:
        """(3, 3, 3) bool voxels."""
        return _hole(0)


@register("primitive", "hole_y")
@dataclass(frozen=True)
class HoleY:
    """A cell with a square through hole along y."""

    def __call__(self) -> np.ndarray:
        """(3, 3, 3) bool voxels."""
        return _hole(1)


@register("primitive", "hole_z")
@dataclass(frozen=True)
class HoleZ:
    """A cell with a square through hole along z."""

    def __call__(self) -> np.ndarray:
        """(3, 3, 3) bool voxels."""
        return _hole(2)
