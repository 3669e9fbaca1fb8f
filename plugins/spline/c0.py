"""Cubic finite elements, to compare splines with."""

from dataclasses import dataclass

from polycube.registry import register
from polycube.spline.spaces.continuous import ContinuousSpace
from polycube.spline.spaces.extraction import volumetric_spline
from polycube.spline.spaces.sharpness import Sharp
from polycube.types import HexMesh

from .volumetric import Volumetric


@register("spline", "c0")
@dataclass(frozen=True)
class C0(Volumetric):
    """The solid of h2s with all Bezier points free: tricubic on each hex, continuous between."""

    def space(self, hexes: HexMesh, sharp: Sharp) -> ContinuousSpace:
        """One function for each Bezier node, with the points of h2s."""
        plain = volumetric_spline(hexes, *sharp)
        return ContinuousSpace(hexes, plain.extraction @ plain.control)
