"""Cubic finite elements, for comparison with splines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from polycube.registry import register
from polycube.types import HexMesh

from .volumetric import Volumetric

if TYPE_CHECKING:
    from polycube.spline.spaces.continuous import ContinuousSpace
    from polycube.spline.spaces.sharpness import Sharp


@register("spline", "c0")
@dataclass(frozen=True)
class C0(Volumetric):
    """The solid of h2s in the space of cubic finite elements, for comparison.

    All Bezier points are free: the functions are tricubic on each hex and continuous between hexes.
    """

    references: ClassVar[tuple[str, ...]] = ("borden2011extraction",)

    def space(self, hexes: HexMesh, sharp: Sharp) -> ContinuousSpace:
        """One function for each Bezier node, with the points of h2s."""
        from polycube.spline.spaces.continuous import ContinuousSpace
        from polycube.spline.spaces.extraction import volumetric_spline

        plain = volumetric_spline(hexes, *sharp)
        return ContinuousSpace(hexes, plain.extraction @ plain.control)
