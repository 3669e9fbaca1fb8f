"""Hexes of the polycube, placed by its rough map."""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

from polycube.errors import MeshingError
from polycube.geometry.cascade import cascade
from polycube.geometry.surface import diagonal
from polycube.geometry.target import target
from polycube.geometry.template import counts, mesh
from polycube.registry import register
from polycube.types import HexMesh, Polycube, RoughMap, TriMesh


@register("meshing/subdivide", "template")
@dataclass(frozen=True)
class Template:
    """Cut every interval of the polycube's lattice into equal parts about `size` long.

    Fine hexes are placed by a cascade of coarser ones that were registered first.
    """

    size: float = 0.05
    finer: float = 1.0
    coarse: float = 0.05
    least: int = 2
    most: int = 40
    across: int = 4
    max_hexes: int = 100_000

    def __call__(self, surface: TriMesh, polycube: Polycube, rough_map: RoughMap) -> HexMesh:
        """Conforming hexes, still off the surface; `patch` names the polycube's faces.

        Raises MeshingError where `size` asks for more than `max_hexes`.
        """
        size = self.size / self.finer * diagonal(surface)
        asked = counts(polycube, rough_map, size, self.least, sys.maxsize, self.across)
        number = np.einsum("xyz,x,y,z->", polycube.occupancy, *(n.astype(float) for n in asked))
        if number > self.max_hexes:
            raise MeshingError(
                f"stage meshing/subdivide: size {self.size:g} asks for {number:.3g} hexes, more "
                f"than max_hexes {self.max_hexes}; take a larger size"
            )
        parts = counts(polycube, rough_map, size, self.least, self.most, self.across)
        coarse = self.coarse * diagonal(surface)
        placed = cascade(polycube, rough_map, target(surface), size, coarse)
        return mesh(polycube, placed, parts)

    def __post_init__(self) -> None:
        for name in ("size", "finer", "coarse", "max_hexes"):
            if getattr(self, name) <= 0:
                raise ValueError(f"{name} must be positive; got {getattr(self, name)}")
