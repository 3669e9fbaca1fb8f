"""A layer of hexes under the boundary."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polycube.fitting.creases.constraints import match
from polycube.fitting.pillow import layer, smooth_regions
from polycube.fitting.problem import FitProblem
from polycube.fitting.registration import register_mesh
from polycube.registry import register
from polycube.surface.fit_target import Target, target
from polycube.types import HexMesh, TriMesh

PATCHES = ("auto", "all", "none")


@register("meshing/pillow", "selective")
@dataclass(frozen=True)
class Selective:
    """Under all of the boundary but regions whose borders are all creases; then settle."""

    patches: str = "auto"
    sharp: float = 0.6
    depth: float = 0.5
    rounds: int = 10
    iterations: int = 25

    def __post_init__(self) -> None:
        if self.patches not in PATCHES:
            raise ValueError(f"patches must be {', '.join(PATCHES)}; got {self.patches!r}")

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        """The hexes with the layer, or the same mesh where no patch wants one."""
        goal = target(surface)
        region, taken = self._taken(hexes, goal)
        if not taken.any():
            return hexes
        layered = layer(hexes, region, taken, self.depth)
        near = {"alpha": (0.04, 0.04), "weight": (3.0, 20.0), "slack": (0.1, 0.05)}
        return register_mesh(layered, goal, self.rounds, self.iterations, **near)

    def _taken(self, hexes: HexMesh, goal: Target) -> tuple[np.ndarray, np.ndarray]:
        """Regions of the quads, and which quads get a layer."""
        if self.patches != "auto":
            return hexes.patch, np.full(len(hexes.patch), self.patches == "all")
        problem, x = FitProblem(hexes, goal, samples=1), goal.to_unit(hexes.vertices)
        return smooth_regions(problem, x, match(problem, x), self.sharp)
