"""Hexes of a section that is moved: along an axis, along a path, through a sheet with bends."""

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
TURN = np.pi / 8  # largest angle of a hex in a bend


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
        from polycube.hexmesh.background.section import section_of
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
        from polycube.hexmesh.background.section import section_of

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
