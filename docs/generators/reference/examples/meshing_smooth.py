from dataclasses import dataclass, replace

import numpy as np

from polycube.registry import register
from polycube.types import HexMesh, TriMesh


@register("meshing/smooth", "to_surface")
@dataclass(frozen=True)
class ToSurface:
    """Move the boundary to the nearest points of the surface, and inner vertices by averages.

    Parameters
    ----------
    rounds : number of averages
    """

    rounds: int = 20

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        from polycube.surface.closest import closest, tree

        outer = np.unique(hexes.quads)
        moved = hexes.vertices.copy()
        moved[outer] = closest(tree(surface.vertices[surface.faces]), moved[outer])[0]
        inner = np.setdiff1d(np.arange(len(moved)), outer)
        for _ in range(self.rounds):
            total = np.zeros_like(moved)
            np.add.at(total, hexes.hexes, moved[hexes.hexes].mean(axis=1, keepdims=True))
            number = np.bincount(hexes.hexes.ravel(), minlength=len(moved))
            moved[inner] = total[inner] / number[inner, None]
        return replace(hexes, vertices=moved)
