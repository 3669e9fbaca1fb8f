from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from polycube.plugins.structure.background.options import ColumnStructure
from polycube.registry import register
from polycube.types import HexMesh, TriMesh


@register("structure", "twisted")
@dataclass(frozen=True, kw_only=True, eq=False)
class Twisted(ColumnStructure):
    """Sweep the bottom face of a bar that is twisted about the z axis.

    Parameters
    ----------
    degrees : angle of the twist
    """

    proposal: ClassVar[str] = "twisted"

    degrees: float = 0.0

    def hexes(self, surface: TriMesh, sizes: Any) -> HexMesh:
        from polycube.hexmesh.background.background import Background, NoBackgroundError
        from polycube.hexmesh.background.columns import columns, layers
        from polycube.hexmesh.background.section import section_of
        from polycube.surface.measures import between_faces, half_edges

        if not len(surface.region):
            raise NoBackgroundError("it has no CAD faces")
        x = surface.vertices
        levels = np.array([x[:, 2].min(), x[:, 2].max()])
        edges = half_edges(surface.faces)[between_faces(surface)[0]]
        ends = x[edges[np.isclose(x[edges, 2], levels[0]).all(axis=1)]][..., :2].reshape(-1, 2)
        lines = np.arange(len(ends)).reshape(-1, 2)

        def place(flat: np.ndarray) -> np.ndarray:
            share = (flat[:, 2] - levels[0]) / np.ptp(levels)
            moved = (flat[:, 0] + 1j * flat[:, 1]) * np.exp(1j * np.radians(self.degrees) * share)
            return np.column_stack([moved.real, moved.imag, flat[:, 2]])

        part = Background(ends, lines, np.zeros((0, 2)), levels, place)
        flat, part, full = section_of(surface, part, sizes)
        number = layers(part.levels, full, sizes.size, sizes.across_wall)
        return columns(flat, part, full, number)
