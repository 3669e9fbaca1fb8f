"""Turned parts: hexes of a profile that is revolved about an axis."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from polycube.registry import register
from polycube.types import HexMesh, TriMesh

from .options import ColumnStructure

if TYPE_CHECKING:
    from polycube.hexmesh.background.curves import Sizes

CORE = 0.55  # radius of the core, relative to the smallest radius of the profile
SMALLEST = 0.03  # of the largest radius of the profile: smaller radii are tips
PROBES = 4  # angles between two levels at which cells must be equally full
LONGEST = 1.5  # of the size: largest edge round the axis


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
        from polycube.hexmesh.background.cells import Cells, cells
        from polycube.hexmesh.background.columns import columns, core, joined
        from polycube.hexmesh.background.curves import curves, curves_round
        from polycube.hexmesh.background.section import section
        from polycube.surface.measures import diagonal

        from .axis import main_axis
        from .profile import NEAR, profile

        near = NEAR * diagonal(surface)
        part = profile(surface, main_axis(surface))
        radius = self._core_radius(part.points, part.marks)
        low, high = part.points[:, 0].min(), part.points[:, 0].max()
        inner = np.array([[[low, 0], [high, 0]], [[low, radius], [high, radius]]])
        lined = part.with_lines(inner)
        points, edges = arrangement(lined.points, lined.lines, near)
        filled = cells(surface, replace(part, levels=_divided(part.levels)), points, edges)
        shares = filled.full.reshape(len(filled.full), -1, PROBES).mean(axis=2)
        if ((shares > 0) & (shares < 1)).any():
            raise NoBackgroundError("it is not equally full round its axis")
        full = shares > 0
        outlines = [points[np.unique(edges[loops[0] // 2])] for loops in filled.loops]
        is_core = np.array([outline[:, 1].max() < radius + near for outline in outlines])
        if not full[is_core].all():
            raise NoBackgroundError("it is only a sector, and contains the axis")
        rings = [n for n, own in enumerate(is_core) if not own]
        ring = Cells(tuple(filled.loops[n] for n in rings), full[rings])
        chains = curves(points, edges, part.marks, 10 * near)
        flat = section(chains, curves_round(chains, ring), ring.full, sizes)
        number = self._sectors(part.points[:, 1].max(), np.diff(part.levels), sizes)
        meshes = [columns(flat, part, ring.full, number)]
        for outline, own in zip(outlines, is_core, strict=True):
            if own:
                meshes.append(core(outline, flat, radius, int(number.sum()), part))
        return joined(meshes, near) if len(meshes) > 1 else meshes[0]

    @staticmethod
    def _core_radius(points: np.ndarray, marks: np.ndarray) -> float:
        """Radius of the core, below that of all ends of curves but tips on the axis."""
        radii, largest = marks[:, 1], float(points[:, 1].max())
        return CORE * float(radii[radii > SMALLEST * largest].min(initial=largest))

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


def _divided(levels: np.ndarray) -> np.ndarray:
    """Levels with PROBES parts between any two."""
    share = np.arange(PROBES) / PROBES
    inner = levels[:-1, None] + np.diff(levels)[:, None] * share
    return np.append(inner.ravel(), levels[-1])
