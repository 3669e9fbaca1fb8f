"""The hex-to-spline construction of TH-spline3D."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from polycube.registry import register
from polycube.types import HexMesh

from .volumetric import Volumetric

if TYPE_CHECKING:
    from polycube.spline.spaces.sharpness import Sharp
    from polycube.spline.spaces.subdivision import ControlMesh


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
