from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from polycube.diffusion.pairs.deformation import Deformation
from polycube.registry import register


@register("data", "single_cells")
@dataclass(frozen=True)
class SingleCells(Deformation):
    """Deformed primitives, each alone in the first cell of the grid."""

    pads = False  # the geometry fills the image

    def __call__(self, grid: Any, primitives: Mapping[str, np.ndarray], seed: int) -> Any:
        from polycube.diffusion.pairs.pairs import Pairs

        empty = (None,) * (int(np.prod(grid)) - 1)
        contexts = [(name, *empty) for name in primitives]
        return Pairs(grid, primitives, contexts, self, seed)
