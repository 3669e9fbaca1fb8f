"""A cube with a square blind hole in the centre of one face, with a depth of two thirds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polycube.registry import register


@dataclass(frozen=True)
class Blind:
    """A cell with a blind hole in the face whose axis label (types.AXES) is `face`."""

    face = 0

    def __call__(self) -> np.ndarray:
        """(3, 3, 3) bool voxels."""
        voxels = np.ones((3, 3, 3), bool)
        row = np.moveaxis(voxels, self.face // 2, 2)[1, 1]
        row[slice(0, 2) if self.face % 2 else slice(1, 3)] = False
        return voxels


@register("primitive", "blind_px")
class BlindPX(Blind):
    """A cell with a square blind hole, open towards +x."""

    face = 0


@register("primitive", "blind_nx")
class BlindNX(Blind):
    """A cell with a square blind hole, open towards -x."""

    face = 1


@register("primitive", "blind_py")
class BlindPY(Blind):
    """A cell with a square blind hole, open towards +y."""

    face = 2


@register("primitive", "blind_ny")
class BlindNY(Blind):
    """A cell with a square blind hole, open towards -y."""

    face = 3


@register("primitive", "blind_pz")
class BlindPZ(Blind):
    """A cell with a square blind hole, open towards +z."""

    face = 4


@register("primitive", "blind_nz")
class BlindNZ(Blind):
    """A cell with a square blind hole, open towards -z."""

    face = 5
