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

    C2 across regular faces, C0 round extraordinary edges.  It approximates the vertices: smooth
    boundary lies inside the mesh's, and there its second normal derivative is 0.
    """

    references: ClassVar[tuple[str, ...]] = ("wei2017th", "yu2022hexgen", "borden2011extraction")

    def space(self, hexes: HexMesh, sharp: Sharp) -> ControlMesh:
        """The functions of the vertices."""
        from polycube.spline.spaces.subdivision import ControlMesh

        return ControlMesh(hexes, *sharp)
