"""Hexes of the polycube, placed by its rough map."""

from __future__ import annotations

from dataclasses import dataclass

from polycube.geometry.surface import diagonal
from polycube.geometry.template import template
from polycube.registry import register
from polycube.types import HexMesh, Polycube, RoughMap, TriMesh


@register("meshing/subdivide", "template")
@dataclass(frozen=True)
class Template:
    """Cut every interval of the polycube's lattice into equal parts about `size` long."""

    size: float = 0.05
    least: int = 2
    most: int = 20
    across: int = 4

    def __call__(self, surface: TriMesh, polycube: Polycube, rough_map: RoughMap) -> HexMesh:
        """Conforming hexes, still off the surface; `patch` names the polycube's faces."""
        size = self.size * diagonal(surface)
        return template(polycube, rough_map, size, self.least, self.most, self.across)
