"""A layer of hexes under the boundary."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polycube.geometry.pillow import insert, smooth_patches
from polycube.geometry.registration import register as fit
from polycube.geometry.target import target
from polycube.registry import register
from polycube.types import HexMesh, TriMesh

PATCHES = ("auto", "all", "none")


@register("meshing/pillow", "selective")
@dataclass(frozen=True)
class Selective:
    """Under every patch but those whose edges are all sharp on the surface; then settle."""

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
        chosen = {
            "auto": lambda: smooth_patches(hexes, goal, self.sharp),
            "all": lambda: np.unique(hexes.patch),
            "none": lambda: np.zeros(0, np.int64),
        }[self.patches]()
        if len(chosen) == 0:
            return hexes
        layered = insert(hexes, chosen, self.depth)
        near = {"alpha": (0.04, 0.04), "weight": (3.0, 20.0), "slack": (0.1, 0.05)}
        return fit(layered, goal, self.rounds, self.iterations, **near)
