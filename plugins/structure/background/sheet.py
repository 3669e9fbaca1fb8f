"""Bent sheets: hexes of the sheet unfolded into a plane, folded back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from polycube.registry import register
from polycube.types import HexMesh, TriMesh

from .bent import TURN
from .sweep import Sweep

if TYPE_CHECKING:
    from polycube.hexmesh.background.curves import Sizes


@register("structure", "sheet")
@dataclass(frozen=True, kw_only=True, eq=False)
class Sheet(Sweep):
    """Unfold a bent sheet into a plane, mesh it as a sweep through its thickness, and fold it.

    For brackets, channels, clips and boxes of sheet metal: parts of constant thickness whose bends
    have an inner radius, with holes, notches and chamfers.
    """

    proposal: ClassVar[str] = "sheet"

    def hexes(self, surface: TriMesh, sizes: Sizes) -> HexMesh:
        """The hexes of the unfolded sheet, folded."""
        from polycube.hexmesh.background.background import NoBackgroundError
        from polycube.hexmesh.quality import volume
        from polycube.surface import measures

        from .moved_back import FILLED
        from .unfolded import unfolded

        def number(radius: float, angle: float) -> float:
            return max(sizes.around(radius) / (2 * np.pi), 1 / TURN) * angle

        sheet = unfolded(surface)
        mesh = self.swept(sheet.surface, sizes, sheet.lines(number))
        mesh = replace(mesh, vertices=sheet.fold(mesh.vertices))
        if abs(volume(mesh) / measures.volume(surface) - 1) > FILLED:
            raise NoBackgroundError("it overlaps itself when it is unfolded")
        return mesh
