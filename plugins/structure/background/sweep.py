"""Sweeps: hexes of parts that are a stack of slabs along a straight axis."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from polycube.registry import register
from polycube.types import HexMesh, TriMesh

from .options import ColumnStructure

if TYPE_CHECKING:
    from polycube.hexmesh.background.curves import Sizes

UPWARD = np.array([0.0, 0.0, 1.0])


@register("structure", "sweep")
@dataclass(frozen=True, kw_only=True, eq=False)
class Sweep(ColumnStructure):
    """Mesh the section of a part with quads, and sweep them along its axis.

    For parts whose faces are perpendicular or parallel to an axis: plates with holes, profiles,
    gears, flanges, with bosses, pockets and steps. Chamfers, fillets, drafts and countersinks of a
    CAD part are allowed.
    """

    proposal: ClassVar[str] = "sweep"

    def hexes(self, surface: TriMesh, sizes: Sizes) -> HexMesh:
        """The hexes of a stack of slabs."""
        return self.swept(surface, sizes)

    def swept(self, surface: TriMesh, sizes: Sizes, lines: np.ndarray | None = None) -> HexMesh:
        """The hexes of a stack of slabs.

        lines : (N, 2, 2) further lines of the section in the plane z = 0, across the axis z; None
            if the axis is not given
        """
        from polycube.hexmesh.background.columns import columns, layers
        from polycube.hexmesh.background.details import section_of
        from polycube.surface.measures import frame

        from .moved_back import moved_back
        from .stack import stack

        part, straight = stack(surface, sizes, None if lines is None else UPWARD)
        if lines is not None:
            part = part.with_lines(lines @ frame(UPWARD)[:2, :2].T)
        if straight is not None:
            sizes = replace(sizes, fine=straight.fine)
        flat, part, full = section_of(straight.surface if straight else surface, part, sizes)
        number = layers(part.levels, full, sizes.size, sizes.across_wall)
        mesh = columns(flat, part, full, number)
        return mesh if straight is None else moved_back(mesh, straight, surface)
