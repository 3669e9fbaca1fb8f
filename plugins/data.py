"""Training pairs: endless, seeded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np

from polycube.diffusion.pairs.deformation import Deformation
from polycube.diffusion.pairs.pairs import Pairs
from polycube.diffusion.pairs.templates import Context, contexts
from polycube.registry import register

Grid = Sequence[int]
Primitives = Mapping[str, np.ndarray]  # name -> (3, 3, 3) bool

TYPES = ("all", "published")
SHAPES = {field.name for field in fields(Deformation)} - {"roughness"}


def published(grid: Grid, primitives: Primitives) -> list[Context]:
    """Contexts of the published set: each primitive alone in each cell, the first in all cells.

    Nine of the 24 contexts of the 2x1 grid with four primitives.
    """
    n_cells = int(np.prod(grid))
    single = [
        tuple(name if cell == here else None for cell in range(n_cells))
        for name in primitives
        for here in range(n_cells)
    ]
    return single if n_cells == 1 else [*single, (next(iter(primitives)),) * n_cells]


@register("data", "paired")
@dataclass(frozen=True)
class Paired(Deformation):
    """Contexts of the grid, deformed into something like a part; options: how strongly."""

    types: str = "all"  # contexts: all, or those of the published set

    pads = False  # each geometry fills the image, whatever its context

    def __post_init__(self) -> None:
        if self.types not in TYPES:
            raise ValueError(f"types must be {' or '.join(TYPES)}; got {self.types!r}")

    def __call__(self, grid: Grid, primitives: Primitives, seed: int) -> Pairs:
        """Pairs by number."""
        chosen = {"all": contexts, "published": published}[self.types](grid, primitives)
        return Pairs(grid, primitives, chosen, self, seed)


@register("data", "paper")
@dataclass(frozen=True)
class Published:
    """The published set: single primitives, and the first one in every cell, all jittered.

    A geometry is its polycube with noise; it has 512 points per occupied cell, then zeros.
    """

    jitter: float = 0.02  # largest standard deviation of the noise, learning frame

    pads = True

    def __call__(self, grid: Grid, primitives: Primitives, seed: int) -> Pairs:
        """Pairs by number."""
        noise = Deformation(**dict.fromkeys(SHAPES, 0.0), roughness=self.jitter)
        return Pairs(grid, primitives, published(grid, primitives), noise, seed, pads=True)
