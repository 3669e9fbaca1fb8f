"""Common base class of the spline plugins: a spline from a surface and hexes."""

from dataclasses import dataclass

from polycube.types import HexMesh, Spline, TriMesh

from .options import SplineOptions


@dataclass(frozen=True)
class Volumetric(SplineOptions):
    """A spline on the hexes in the space of a subclass."""

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> Spline:
        """The spline; logs how many edges are sharp and the smallest det J."""
        from .construction import constructed

        return constructed(self, surface, hexes)
