"""Unit cells of polycubes: those of the paper, with crossing holes, with a blind hole."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from polycube.registry import register

THROUGH = {  # axes of the holes; crossing holes have genus 3 or 5
    "hole_x": ((0,), "a square through hole along x"),
    "hole_y": ((1,), "a square through hole along y"),
    "hole_z": ((2,), "a square through hole along z"),
    "cross_xy": ((0, 1), "crossing square through holes along x and y"),
    "cross_xz": ((0, 2), "crossing square through holes along x and z"),
    "cross_yz": ((1, 2), "crossing square through holes along y and z"),
    "cross_xyz": (
        (0, 1, 2),
        "crossing square through holes along all three axes: the frame of a cube",
    ),
}
SIDES = {"px": "+x", "nx": "-x", "py": "+y", "ny": "-y", "pz": "+z", "nz": "-z"}  # of blind holes


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


@dataclass(frozen=True)
class Blind:
    """A cell with a hole, two thirds deep, in the face whose axis label (types.AXES) is `face`."""

    face = 0

    def __call__(self) -> np.ndarray:
        """(3, 3, 3) bool voxels."""
        voxels = np.ones((3, 3, 3), bool)
        row = np.moveaxis(voxels, self.face // 2, 2)[1, 1]
        row[slice(0, 2) if self.face % 2 else slice(1, 3)] = False
        return voxels


for name, (axes, what) in THROUGH.items():
    register("primitive", name)(
        type(name, (Cube,), {"axes": axes, "__doc__": f"A cell with {what}."})
    )
for number, (name, side) in enumerate(SIDES.items()):
    text = f"A cell with a square blind hole, open towards {side}."
    cell = type(f"blind_{name}", (Blind,), {"face": number, "__doc__": text})
    register("primitive", f"blind_{name}")(cell)
