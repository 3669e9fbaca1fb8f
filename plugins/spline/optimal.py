"""Cubic splines of full order on an unstructured hex mesh."""

from dataclasses import dataclass

from polycube.registry import register
from polycube.spline.spaces.extraction import volumetric_spline
from polycube.spline.spaces.optimal import OptimalSpace, smallest_space
from polycube.spline.spaces.sharpness import Sharp
from polycube.types import HexMesh

from .volumetric import Volumetric


@register("spline", "optimal")
@dataclass(frozen=True)
class Optimal(Volumetric):
    """The solid of h2s in a larger space: all tricubics on each hex, clamped at the boundary.

    C2 but for faces at extraordinary edges and creases and the sides of the hexes there.  Halving
    the hexes gives a space that contains it.
    """

    def space(self, hexes: HexMesh, sharp: Sharp) -> OptimalSpace:
        """The functions, with the Bezier points of h2s."""
        plain = volumetric_spline(hexes, *sharp)
        points = plain.extraction @ plain.control
        return smallest_space(hexes, points, *sharp)
