"""Sweeps: hexes of parts that are a stack of slabs along a straight axis."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from polycube.hexmesh.settings import MeshingSettings, curvature_of, features_of
from polycube.kinds import Structure
from polycube.registry import register, setting
from polycube.structure.primitives import full_cell
from polycube.types import Candidate, HexMesh, Tier, TriMesh

logger = logging.getLogger(__name__)

NONE = "sweep: nothing is proposed, because %s"


@register("structure", "sweep")
@dataclass(frozen=True, kw_only=True, eq=False)
class Sweep(Structure):
    """Mesh the section of a part with quads, and sweep them along its axis.

    For parts whose faces are perpendicular or parallel to an axis: plates with holes, profiles,
    gears, flanges, with bosses, pockets and steps. All curves of the section are on edges of quads,
    and holes are regular polygons. It needs Gmsh for the quads.

    Parameters
    ----------
    grid : cells of the polycube; not used
    primitives : (3, 3, 3) bool voxels by name
    size : wanted edge length of the hexes, in the units of the part or as a share of the diagonal
    curvature : largest distance of the edges from the curves of the section; auto: 0.3%, or 0.2%
        with exact features; null: no limit
    features : whether features are exact; see `meshing.features`
    across_wall : smallest number of hexes through every wall
    around_hole : smallest number of edges round every full circle
    level : the hexes are 2^level times smaller than the size; null: they have the size
    max_hexes : largest number of hexes; a part that needs more is not proposed
    """

    references: ClassVar[tuple[str, ...]] = ("remacle2012blossom", "geuzaine2009gmsh")

    tier = Tier.EXACT
    any_grid = True

    grid: tuple[int, int, int]
    primitives: Mapping[str, np.ndarray]
    size: float | str = setting("meshing.size", MeshingSettings.size)
    curvature: float | str | None = setting("meshing.curvature", MeshingSettings.curvature)
    features: str = setting("meshing.features", MeshingSettings.features)
    across_wall: float = setting("meshing.across_wall", MeshingSettings.across_wall)
    around_hole: float | str = setting("meshing.around_hole", MeshingSettings.around_hole)
    level: int | None = setting("meshing.level", MeshingSettings.level)
    max_hexes: int = setting("meshing.max_hexes", MeshingSettings.max_hexes)

    def __call__(self, surface: TriMesh, candidates: tuple[Candidate, ...]) -> list[Candidate]:
        """One candidate with hexes, or none if the part is not such a stack."""
        from polycube.hexmesh.background.background import NoBackgroundError
        from polycube.hexmesh.generation.blocks import candidate
        from polycube.hexmesh.generation.quads import NoQuadsError

        brick = full_cell(self.primitives)
        if brick is None:
            logger.info("sweep: no primitive is a full cell; nothing is proposed")
            return []
        try:
            blocks = self._hexes(surface)
        except (NoBackgroundError, NoQuadsError) as reason:
            logger.info(NONE, reason)
            return []
        swept = candidate(blocks, surface, brick, "sweep")
        return [replace(swept, tier=self.tier, variants="sweep")]

    def _hexes(self, surface: TriMesh) -> HexMesh:
        from polycube.hexmesh.background.arrangement import arrangement
        from polycube.hexmesh.background.background import NoBackgroundError
        from polycube.hexmesh.background.cells import cells
        from polycube.hexmesh.background.columns import columns, layers
        from polycube.hexmesh.background.curves import Sizes, curves, curves_round
        from polycube.hexmesh.background.section import section
        from polycube.hexmesh.generation import sizing
        from polycube.surface.measures import diagonal, volume

        from .axis import NEAR, stack

        unit = diagonal(surface)
        part = stack(surface)
        points, edges = arrangement(part.points, part.lines, NEAR * unit)
        filled = cells(surface, part, points, edges)
        chains = curves(points, edges, part.marks, 10 * NEAR * unit)
        size = sizing.length(self.size, unit) / 2 ** (self.level or 0)
        if volume(surface) > self.max_hexes * size**3:
            raise NoBackgroundError(f"it needs more than max_hexes {self.max_hexes}")
        exact = features_of(self.features, surface) == "exact"
        chord = np.inf
        if self.curvature is not None:
            chord = sizing.length(curvature_of(self.curvature, exact), unit)
        wanted = Sizes(size, chord, self.across_wall, self.around_hole)
        flat = section(chains, curves_round(chains, filled), wanted)
        number = layers(part.levels, filled.full, size, self.across_wall)
        found = columns(flat, part, filled.full, number)
        if len(found.hexes) > self.max_hexes:
            raise NoBackgroundError(f"it needs more than max_hexes {self.max_hexes}")
        return found
