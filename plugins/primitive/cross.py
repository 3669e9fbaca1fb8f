"""A cube with square through holes along two or three axes, which cross in its centre."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from polycube.registry import register


@dataclass(frozen=True)
class Cross:
    """A cell with a through hole along each of `axes`: two have genus 3, three have genus 5."""

    axes: ClassVar[tuple[int, ...]] = (0, 1, 2)

    def __call__(self) -> np.ndarray:
        """(3, 3, 3) bool voxels."""
        voxels = np.ones((3, 3, 3), bool)
        for axis in self.axes:
            np.moveaxis(voxels, axis, 2)[1, 1] = False
        return voxels


@register("primitive", "cross_xy")
class CrossXY(Cross):
    """A cell with crossing square through holes along x and y."""

    axes = (0, 1)


@register("primitive", "cross_xz")
class CrossXZ(Cross):
    """A cell with crossing square through holes along x and z."""

    axes = (0, 2)


@register("primitive", "cross_yz")
class CrossYZ(Cross):
    """A cell with crossing square through holes along y and z."""

    axes = (1, 2)


@register("primitive", "cross_xyz")
class CrossXYZ(Cross):
    """A cell with crossing square through holes along all three axes: the frame of a cube."""

    axes = (0, 1, 2)
