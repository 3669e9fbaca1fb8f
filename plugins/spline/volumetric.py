"""Spline plugins: a spline from a surface and hexes, in one of three spaces."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from polycube.registry import register
from polycube.types import HexMesh, Spline, TriMesh

from .options import SplineOptions

if TYPE_CHECKING:
    from polycube.spline.spaces.continuous import ContinuousSpace
    from polycube.spline.spaces.hierarchy import Space
    from polycube.spline.spaces.optimal import OptimalSpace
    from polycube.spline.spaces.sharpness import Sharp
    from polycube.spline.spaces.subdivision import ControlMesh


@dataclass(frozen=True)
class Volumetric(SplineOptions, ABC):
    """A spline on the hexes in the space of a subclass."""

    @abstractmethod
    def space(self, hexes: HexMesh, sharp: Sharp) -> Space:
        """The functions on the hexes and their coefficients."""

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> Spline:
        """The spline; logs how many edges are sharp and the smallest det J."""
        from .construction import constructed

        return constructed(self, self.space, surface, hexes)


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


@register("spline", "h2s")
@dataclass(frozen=True)
class H2S(Volumetric):
    """Tricubic spline whose control points are the vertices of the hex mesh.

    It is C2 across regular faces and C0 around extraordinary edges. It approximates the vertices: a
    smooth boundary is inside that of the mesh, and its second normal derivative is 0 there.
    """

    references: ClassVar[tuple[str, ...]] = ("wei2017th", "yu2022hexgen", "borden2011extraction")

    def space(self, hexes: HexMesh, sharp: Sharp) -> ControlMesh:
        """The functions of the vertices."""
        from polycube.spline.spaces.subdivision import ControlMesh

        return ControlMesh(hexes, *sharp)


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
