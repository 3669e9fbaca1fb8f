"""Cubic splines of optimal order on an unstructured hex mesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from polycube.registry import register
from polycube.types import HexMesh

from .volumetric import Volumetric

if TYPE_CHECKING:
    from polycube.spline.spaces.optimal import OptimalSpace
    from polycube.spline.spaces.sharpness import Sharp


@register("spline", "optimal")
@dataclass(frozen=True)
class Optimal(Volumetric):
    """The solid of h2s in a larger space of optimal order, clamped at the boundary.

    The space contains all tricubic polynomials on each hex. It is C2 except across faces at
    extraordinary edges and creases and the adjacent sides of hexes. Dividing the hexes gives a
    space that contains it.
    """

    references: ClassVar[tuple[str, ...]] = ("borden2011extraction",)

    def space(self, hexes: HexMesh, sharp: Sharp) -> OptimalSpace:
        """The functions, with the Bezier points of h2s."""
        from polycube.spline.spaces.extraction import volumetric_spline
        from polycube.spline.spaces.optimal import smallest_space

        plain = volumetric_spline(hexes, *sharp)
        points = plain.extraction @ plain.control
        return smallest_space(hexes, points, *sharp)
