"""The hex-to-spline construction of TH-spline3D."""

from dataclasses import dataclass

from polycube.registry import register
from polycube.spline.spaces.sharpness import Sharp
from polycube.spline.spaces.subdivision import ControlMesh
from polycube.types import HexMesh

from .volumetric import Volumetric


@register("spline", "h2s")
@dataclass(frozen=True)
class H2S(Volumetric):
    """Tricubic spline with the mesh's vertices as control points.

    C2 across regular faces, C0 round extraordinary edges.  It approximates the vertices: smooth
    boundary lies inside the mesh's, and there its second normal derivative is 0.
    """

    def space(self, hexes: HexMesh, sharp: Sharp) -> ControlMesh:
        """The functions of the vertices."""
        return ControlMesh(hexes, *sharp)
