"""Bent bars and tubes: hexes of a section that is moved along lines, arcs and helices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from polycube.registry import register
from polycube.types import HexMesh, TriMesh

from .options import ColumnStructure

if TYPE_CHECKING:
    from polycube.hexmesh.background.curves import Sizes

TURN = np.pi / 8  # largest angle of a hex in a bend


@register("structure", "bent")
@dataclass(frozen=True, kw_only=True, eq=False)
class Bent(ColumnStructure):
    """Mesh an end of a bent bar or tube with quads, and move them along its path.

    For elbows, bent tubes, rods, channels, strips and springs: parts with a constant section along
    straight lines, arcs and helices.
    """

    proposal: ClassVar[str] = "bent"

    def hexes(self, surface: TriMesh, sizes: Sizes) -> HexMesh:
        """The hexes of a section along its path."""
        from polycube.hexmesh.background.columns import columns, layers
        from polycube.hexmesh.background.details import section_of

        from .path import path

        found = path(surface)
        part = found.background
        flat, part, full = section_of(surface, part, sizes)
        number = layers(part.levels, full, sizes.size, sizes.across_wall)
        for k, (motion, radius) in enumerate(zip(found.motions, found.radius, strict=True)):
            if motion.angle:
                turns = sizes.around(radius) / (2 * np.pi), 1 / TURN
                number[k] = max(number[k], np.ceil(motion.angle * max(turns) - 0.05))
        return columns(flat, part, full, number)
