from dataclasses import dataclass

import numpy as np

from polycube.registry import register


@register("primitive", "corner_cut")
@dataclass(frozen=True)
class CornerCut:
    """A cell without the voxel at its highest corner."""

    def __call__(self) -> np.ndarray:
        voxels = np.ones((3, 3, 3), bool)
        voxels[2, 2, 2] = False
        return voxels
