"""Cubes with through holes along two or three axes, which cross in the centre: genus 3 or 5."""

from polycube.registry import register

from .cube_and_hole import Cube


@register("primitive", "cross_xy")
class CrossXY(Cube):
    """A cell with crossing square through holes along x and y."""

    axes = (0, 1)


@register("primitive", "cross_xz")
class CrossXZ(Cube):
    """A cell with crossing square through holes along x and z."""

    axes = (0, 2)


@register("primitive", "cross_yz")
class CrossYZ(Cube):
    """A cell with crossing square through holes along y and z."""

    axes = (1, 2)


@register("primitive", "cross_xyz")
class CrossXYZ(Cube):
    """A cell with crossing square through holes along all three axes: the frame of a cube."""

    axes = (0, 1, 2)
