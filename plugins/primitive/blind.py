"""A cube with a square blind hole in the centre of one face, with a depth of two thirds."""

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


for number, side in enumerate(("+x", "-x", "+y", "-y", "+z", "-z")):
    text = f"A cell with a square blind hole, open towards {side}."
    name = f"{'np'[side[0] == '+']}{side[1]}"
    cell = type(f"Blind{name.upper()}", (Blind,), {"face": number, "__doc__": text})
    register("primitive", f"blind_{name}")(cell)
