"""Hexes of a section that is moved: along an axis or a path, in a bent sheet, about an axis."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from polycube.registry import register
from polycube.types import HexMesh, TriMesh

from .options import ColumnStructure

if TYPE_CHECKING:
    from polycube.hexmesh.background.curves import Sizes

    from .bends.straightened import Straightened

UPWARD = np.array([0.0, 0.0, 1.0])
CORE = 0.55  # radius of the core, relative to the smallest radius of the profile
SMALLEST = 0.03  # of the largest radius of the profile: smaller radii are tips
PROBES = 4  # angles between two levels at which cells must be equally full
LONGEST = 1.5  # of the size: largest edge round the axis


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

    def swept(
        self,
        surface: TriMesh,
        sizes: Sizes,
        lines: np.ndarray | None = None,
        bends: Straightened | None = None,
    ) -> HexMesh:
        """The hexes of a stack of slabs.

        lines : (N, 2, 2) further lines of the section of an unfolded sheet in the plane z = 0,
            across the axis z
        bends : of a straightened part, which is swept along its axis
        """
        from polycube.hexmesh.background.columns import columns, layers
        from polycube.hexmesh.background.section import section_of
        from polycube.surface.measures import frame

        from .moved_back import moved_back
        from .stack import stack

        axis = bends.axis if bends else None if lines is None else UPWARD
        part, straight = stack(surface, sizes, axis, lines is None)
        if lines is not None:
            part = part.with_lines(lines @ frame(UPWARD)[:2, :2].T)
        if straight is not None:
            sizes = replace(sizes, fine=straight.fine)
        flat, part, full = section_of(straight.surface if straight else surface, part, sizes)
        number = layers(part.levels, full, sizes.size, sizes.across_wall)
        if bends:
            number = bends.layers(part.levels, number, sizes)
        mesh = columns(flat, part, full, number)
        return mesh if straight is None else moved_back(mesh, straight, surface)


@register("structure", "bent")
@dataclass(frozen=True, kw_only=True, eq=False)
class Bent(Sweep):
    """Mesh an end of a bent bar or tube with quads, and move them along its path.

    For elbows, bent tubes, rods, channels, strips and springs: parts with a constant section along
    straight lines, arcs and helices. Others, such as flanged elbows, are straightened at their
    round bends, swept, and bent back.
    """

    proposal: ClassVar[str] = "bent"

    def hexes(self, surface: TriMesh, sizes: Sizes) -> HexMesh:
        """The hexes of a section along its path, or of the straight part."""
        from polycube.hexmesh.background.background import NoBackgroundError

        from .bends.straightened import straightened

        try:
            return self._along(surface, sizes)
        except NoBackgroundError:
            if (part := straightened(surface)) is None:
                raise
        mesh = self.swept(part.surface, sizes, bends=part)
        return replace(mesh, vertices=part.bend(mesh.vertices))

    def _along(self, surface: TriMesh, sizes: Sizes) -> HexMesh:
        """The hexes of a section along its path."""
        from polycube.hexmesh.background.columns import columns, layers
        from polycube.hexmesh.background.curves import whole
        from polycube.hexmesh.background.motion import edges_in_bend
        from polycube.hexmesh.background.section import section_of

        from .bends.path import path

        found = path(surface)
        part = found.background
        flat, part, full = section_of(surface, part, sizes)
        number = layers(part.levels, full, sizes.size, sizes.across_wall)
        for k, (motion, radius) in enumerate(zip(found.motions, found.radius, strict=True)):
            if motion.angle:
                number[k] = max(number[k], whole(edges_in_bend(sizes, radius, motion.angle)))
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

        from .bends.unfolded import unfolded
        from .moved_back import FILLED

        sheet = unfolded(surface)
        mesh = self.swept(sheet.surface, sizes, sheet.lines(sizes))
        mesh = replace(mesh, vertices=sheet.fold(mesh.vertices))
        if abs(volume(mesh) / measures.volume(surface) - 1) > FILLED:
            raise NoBackgroundError("it overlaps itself when it is unfolded")
        return mesh


@register("structure", "turned")
@dataclass(frozen=True, kw_only=True, eq=False)
class Turned(ColumnStructure):
    """Mesh the profile of a turned part with quads, and revolve them about its axis.

    For shafts, rings, pulleys, sleeves and their halves and sectors, with chamfers, fillets, cones
    and spheres. Around the axis, a disc of quads is swept along it.
    """

    proposal: ClassVar[str] = "turned"

    def hexes(self, surface: TriMesh, sizes: Sizes) -> HexMesh:
        """The hexes of a profile, and of the core along the axis."""
        from polycube.hexmesh.background.arrangement import arrangement
        from polycube.hexmesh.background.background import NoBackgroundError
        from polycube.hexmesh.background.cells import cells
        from polycube.hexmesh.background.columns import columns, core, joined
        from polycube.hexmesh.background.curves import curves, curves_round
        from polycube.hexmesh.background.section import section
        from polycube.surface.measures import diagonal

        from .axis import main_axis
        from .profile import NEAR, profile

        near = NEAR * diagonal(surface)
        part = profile(surface, main_axis(surface))
        radii, largest = part.marks[:, 1], float(part.points[:, 1].max())
        # the core is below all ends of curves but tips on the axis
        radius = CORE * float(radii[radii > SMALLEST * largest].min(initial=largest))
        low, high = part.points[:, 0].min(), part.points[:, 0].max()
        lined = part.with_lines(np.array([[[low, 0], [high, 0]], [[low, radius], [high, radius]]]))
        points, edges = arrangement(lined.points, lined.lines, near)
        share = np.arange(PROBES) / PROBES
        inside = part.levels[:-1, None] + np.diff(part.levels)[:, None] * share
        divided = replace(part, levels=np.append(inside.ravel(), part.levels[-1]))
        loops, filled = cells(surface, divided, points, edges)
        shares = filled.reshape(len(filled), -1, PROBES).mean(axis=2)
        if ((shares > 0) & (shares < 1)).any():
            raise NoBackgroundError("it is not equally full round its axis")
        full = shares > 0
        outlines = [points[np.unique(edges[outer // 2])] for outer, *_ in loops]
        is_core = np.array([outline[:, 1].max() < radius + near for outline in outlines])
        if not full[is_core].all():
            raise NoBackgroundError("it is only a sector, and contains the axis")
        rings = [own for own, is_inside in zip(loops, is_core, strict=True) if not is_inside]
        chains = curves(points, edges, part.marks, 10 * near)
        flat = section(chains, curves_round(chains, rings), full[~is_core], sizes)
        number = self._sectors(largest, np.diff(part.levels), sizes)
        meshes = [columns(flat, part, full[~is_core], number)]
        for outline, own in zip(outlines, is_core, strict=True):
            if own:
                meshes.append(core(outline, flat, radius, int(number.sum()), part))
        return joined(meshes, near) if len(meshes) > 1 else meshes[0]

    @staticmethod
    def _sectors(radius: float, turns: np.ndarray, sizes: Sizes) -> np.ndarray:
        """(K,) number of hexes round the axis between levels; together a multiple of 4."""
        from polycube.hexmesh.settings import edges_around

        around = 2 * np.pi * radius
        chord = np.pi / np.arccos(max(1 - sizes.chord / radius, 0.0))
        least = edges_around(sizes.around_hole, around, sizes.size)
        whole = max(chord, around / (LONGEST * sizes.size), least)
        if len(turns) == 1:
            return np.array([4 * int(np.ceil(whole / 4))])
        return np.maximum(1, np.ceil(turns / (2 * np.pi) * whole - 0.01)).astype(int)
