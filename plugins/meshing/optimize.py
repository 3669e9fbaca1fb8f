"""Raise the worst hex with the boundary on the surface."""

from __future__ import annotations

from dataclasses import dataclass

from polycube.fitting.polish import polish
from polycube.registry import register
from polycube.surface.fit_target import target
from polycube.types import HexMesh, TriMesh


@register("meshing/optimize", "polish")
@dataclass(frozen=True)
class Polish:
    """Soft minimum of the scaled Jacobian: soft rounds, hard ones, local ones; the best is kept."""

    features: bool = True
    soft_rounds: int = 8
    hard_rounds: int = 4
    local_rounds: int = 40
    crease_rounds: int = 12
    samples: int = 2500

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        """The same hexes, better; never with a worse score than they came."""
        return polish(
            hexes,
            target(surface),
            features=self.features,
            soft_rounds=self.soft_rounds,
            hard_rounds=self.hard_rounds,
            local_rounds=self.local_rounds,
            crease_rounds=self.crease_rounds,
            samples=self.samples,
        )
