"""Untangle the hexes and bring their boundary onto the surface."""

from __future__ import annotations

from dataclasses import dataclass

from polycube.geometry.registration import register as fit
from polycube.geometry.target import target
from polycube.registry import register
from polycube.types import HexMesh, TriMesh


@register("meshing/smooth", "register")
@dataclass(frozen=True)
class Register:
    """Descent of a foldover-free energy with pulls between mesh and surface, both ways."""

    rounds: int = 25
    iterations: int = 25
    samples: int = 2500
    coverage: float = 0.5

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        """The same hexes, near the surface."""
        return fit(
            hexes,
            target(surface),
            self.rounds,
            self.iterations,
            self.samples,
            coverage=self.coverage,
        )
