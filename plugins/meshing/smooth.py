"""Untangle the hexes and bring their boundary onto the surface."""

from __future__ import annotations

from dataclasses import dataclass

from polycube.fitting.registration import register_mesh
from polycube.registry import register
from polycube.surface.fit_target import target
from polycube.types import HexMesh, TriMesh

QUICK = 15, 1500  # iterations and samples of the first rounds
# how weak pulls are, and how much normals count, after the first rounds
ALPHA, WEIGHT, SLACK = (0.07, 0.04), (3.0, 20.0), (0.2, 0.05)


@register("meshing/smooth", "register")
@dataclass(frozen=True)
class Register:
    """Descent of a foldover-free energy with pulls between mesh and surface, both ways.

    A few quick rounds make the pulls strong before the mesh slides out of its place, as it may in
    many rounds of weak ones; `rounds` of strong ones follow.
    """

    quick: int = 7
    rounds: int = 12
    iterations: int = 25
    samples: int = 2500
    coverage: float = 0.5

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        """The same hexes, near the surface; where they were with no rounds."""
        if self.rounds == 0:
            return hexes
        goal = target(surface)
        near = register_mesh(hexes, goal, self.quick, *QUICK, coverage=self.coverage)
        return register_mesh(
            near,
            goal,
            self.rounds,
            self.iterations,
            self.samples,
            alpha=ALPHA,
            weight=WEIGHT,
            slack=SLACK,
            coverage=self.coverage,
        )
