"""Training pairs: endless streams with a seed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np

from polycube.diffusion.pairs.deformation import Deformation
from polycube.registry import register
from polycube.types.options import Options, Share, limits

if TYPE_CHECKING:
    from polycube.diffusion.pairs.any_structure import LatticePairs
    from polycube.diffusion.pairs.pairs import MeshPairs, Pairs
    from polycube.diffusion.pairs.templates import Context

Grid = Sequence[int] | None  # none for arbitrary structures
Primitives = Mapping[str, np.ndarray]  # name -> (3, 3, 3) bool

Types = Literal["all", "published"]


def published(grid: Sequence[int], primitives: Primitives) -> list[Context]:
    """Contexts of the published set: each primitive alone in each cell, and the first in all.

    Nine of the 24 contexts of the 2x1 grid with four primitives.
    """
    n_cells = int(np.prod(grid))
    single = [
        tuple(name if cell == here else None for cell in range(n_cells))
        for name in primitives
        for here in range(n_cells)
    ]
    return single if n_cells == 1 else [*single, (next(iter(primitives)),) * n_cells]


def _contexts(types: str, grid: Sequence[int], primitives: Primitives) -> list[Context]:
    from polycube.diffusion.pairs.templates import contexts

    return {"all": contexts, "published": published}[types](grid, primitives)


@register("data", "paired")
@dataclass(frozen=True)
class Paired(Options, Deformation):
    """Polycubes of all contexts of the grid, deformed into shapes that resemble real parts.

    With grid=any, the polycubes are random lattices (`polycube/diffusion/pairs/any_structure.py`).
    Then only the last two options have an effect; all others are for grids of primitives.

    Parameters
    ----------
    types : contexts of the pairs: all, or published (the nine of the published set for 2x1)
    cad : with grid=any, share of parts with CAD features only
    organic : with grid=any, share of parts that are only deformed; the remaining parts have CAD
        features and are deformed
    """

    types: Types = "all"
    cad: Share = 0.6
    organic: Share = 0.2

    pads = False  # the geometry fills the whole image, for any context

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.cad + self.organic > 1:
            shares = f"{self.cad}, {self.organic}"
            raise ValueError(f"cad and organic must be shares, together at most 1; got {shares}")

    def __call__(self, grid: Grid, primitives: Primitives, seed: int) -> Pairs | LatticePairs:
        """The stream; pairs are computed by their number."""
        from polycube.diffusion.conditions import AnyStructure
        from polycube.diffusion.pairs.any_structure import LatticePairs, LatticeShapes
        from polycube.diffusion.pairs.pairs import Pairs

        if not grid:
            shapes = LatticeShapes(cad=self.cad, organic=self.organic)
            return LatticePairs(seed, math.prod(AnyStructure.image), shapes)
        return Pairs(grid, primitives, _contexts(self.types, grid, primitives), self, seed)


@register("data", "paper")
@dataclass(frozen=True)
class Published(Options):
    """Published data: primitives as meshes of fixed vertices, and the same meshes rounded.

    Vertex i of the geometry belongs to vertex i of the polycube, and both are in the same frame. A
    cell has 512 vertices; the pixels of an empty cell are zero. The seed has no effect.

    Parameters
    ----------
    types : contexts of the pairs: published (the nine of the published set for 2x1), or all
    rounding : smoothing of the geometries; 3 is close to the published ones
    """

    types: Types = "published"
    rounding: Annotated[float, limits(0)] = 3.0

    pads = True
    fixed = True

    def __call__(self, grid: Grid, primitives: Primitives, seed: int) -> MeshPairs:
        """The stream; the pairs of a context are all equal."""
        from polycube.diffusion.pairs.pairs import MeshPairs

        if not grid:
            raise ValueError("data=paper needs a grid; use data=paired with grid=any")
        return MeshPairs(grid, primitives, _contexts(self.types, grid, primitives), self.rounding)
