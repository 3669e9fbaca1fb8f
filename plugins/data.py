"""Training pairs: endless, seeded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from polycube.diffusion.deformation import Deformation
from polycube.diffusion.pairs import Pairs
from polycube.diffusion.templates import contexts
from polycube.registry import register


@register("data", "paired")
@dataclass(frozen=True)
class Paired(Deformation):
    """Every context of the grid, deformed into something like a part; options: how strongly."""

    pads = False  # each geometry fills the image, whatever its context

    def __call__(
        self, grid: Sequence[int], primitives: Mapping[str, np.ndarray], seed: int
    ) -> Pairs:
        """Pairs by number; primitives: name -> (3, 3, 3) bool."""
        return Pairs(grid, primitives, contexts(grid, primitives), self, seed)


@register("data", "paper")
@dataclass(frozen=True)
class Published:
    """The published set: single primitives, and the first one in every cell, all jittered.

    A geometry is its polycube with noise; it has 512 points per occupied cell, then zeros.
    """

    jitter: float = 0.02  # largest standard deviation of the noise, learning frame

    pads = True

    def __call__(
        self, grid: Sequence[int], primitives: Mapping[str, np.ndarray], seed: int
    ) -> Pairs:
        """Pairs by number; nine contexts for the 2x1 grid with four primitives."""
        n_cells = int(np.prod(grid))
        single = [
            tuple(name if cell == here else None for cell in range(n_cells))
            for name in primitives
            for here in range(n_cells)
        ]
        chosen = single if n_cells == 1 else [*single, (next(iter(primitives)),) * n_cells]
        noise = Deformation(**dict.fromkeys(_SHAPES, 0.0), roughness=self.jitter)
        return Pairs(grid, primitives, chosen, noise, seed, pads=True)


_SHAPES = ("rounding", "warp", "disc", "stretch", "profile", "waves", "bend", "twist", "rotation")
