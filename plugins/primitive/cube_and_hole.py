"""The unit cells of the paper: a cube, and a cube with a square through hole along one axis."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from polycube.registry import register


@register("primitive", "cube")
@dataclass(frozen=True)
class Cube:
    """A full cell."""

    axes: ClassVar[tuple[int, ...]] = ()  # of the through holes

    def __call__(self) -> np.ndarray:
        """(3, 3, 3) bool voxels."""
        voxels = np.ones((3, 3, 3), bool)
        for axis in self.axes:
            np.moveaxis(voxels, axis, 2)[1, 1] = False
        return voxels


@register("primitive", "hole_x")
class HoleX(Cube):
    """A cell with a square through hole along x."""

    axes = (0,)


@register("primitive", "hole_y")
class HoleY(Cube):
    """A cell with a square through hole along y."""

    axes = (1,)


@register("primitive", "hole_z")
class HoleZ(Cube):
    """A cell with a square through hole along z."""

    axes = (2,)
