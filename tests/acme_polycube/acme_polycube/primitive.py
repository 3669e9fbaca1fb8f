"""Unit cells."""

from dataclasses import dataclass

import numpy as np

from polycube.registry import register


@register("primitive", "notch")
@dataclass(frozen=True)
class Notch:
    """A cell with one of its edges along y cut away: the one at high x and high z.

    Parameters
    ----------
    depth : of the cut, in voxels of 3
    """

    depth: int = 1

    def __call__(self) -> np.ndarray:
        """(3, 3, 3) bool voxels."""
        voxels = np.ones((3, 3, 3), bool)
        voxels[3 - self.depth :, :, 3 - self.depth :] = False
        return voxels
