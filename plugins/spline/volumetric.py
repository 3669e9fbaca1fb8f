"""Common base class of the spline plugins: a spline from a surface and hexes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from polycube.types import HexMesh, Spline, TriMesh

from .options import SplineOptions

if TYPE_CHECKING:
    from polycube.spline.spaces.sharpness import Sharp


@dataclass(frozen=True)
class Volumetric(SplineOptions):
    """A spline on the hexes in the space of a subclass."""

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> Spline:
        """The spline; logs how many edges are sharp and the smallest det J."""
        from .construction import constructed

        return constructed(self, surface, hexes)

    def sharpened(self, hexes: HexMesh, surface: TriMesh | None = None) -> Sharp:
        """Sharp edges and corners; of the creases, the harmless ones.

        surface : surface of a CAD model, which defines the creases; None: creases by angle

        Raises InputError if given edges are not on the boundary.
        """
        from .construction import sharpened

        return sharpened(self, hexes, surface)
