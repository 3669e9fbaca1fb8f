"""What structures of columns over a section have in common: options, sizes and refusals."""

from __future__ import annotations

import logging
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from polycube.hexmesh.generation.requests import requests_of
from polycube.hexmesh.settings import curvature_of, edges_around, features_of
from polycube.kinds import Structure
from polycube.registry import setting
from polycube.structure.primitives import OnGrid, full_cell
from polycube.types import Candidate, HexMesh, Tier, TriMesh

if TYPE_CHECKING:
    from polycube.hexmesh.background.curves import Sizes

logger = logging.getLogger(__name__)

GOOD = 0.5  # smallest scaled Jacobian of exact hexes with which no others are proposed


@dataclass(frozen=True, kw_only=True, eq=False)
class ColumnStructure(OnGrid, Structure):
    """Propose the columns of hexes over the quads of a section.

    All curves of the section are on edges of quads, and holes are regular polygons. It needs Gmsh
    for the quads.

    Parameters
    ----------
    size : wanted edge length of the hexes, in the units of the part or as a share of the diagonal
    curvature : largest distance of the edges from the curves of the section; auto: 0.3%, or 0.2%
        with exact features; null: no limit
    features : whether features are exact; see `meshing.features`
    across_wall : smallest number of hexes through every wall
    around_hole : smallest number of edges round every full circle
    at : numbers of hexes at faces of the part, as `meshing.at`; the largest number round a hole and
        through a wall, and the smallest size, hold everywhere
    level : the hexes are 2^level times smaller than the size; null: they have the size
    max_hexes : largest number of hexes; a part that needs more is not proposed
    """

    references: ClassVar[tuple[str, ...]] = ("remacle2013frontal", "geuzaine2009gmsh")
    proposal: ClassVar[str]

    tier = Tier.EXACT
    any_grid = True

    size: float | str = setting("meshing.size")
    curvature: float | str | None = setting("meshing.curvature")
    features: str = setting("meshing.features")
    across_wall: float = setting("meshing.across_wall")
    around_hole: float | str = setting("meshing.around_hole")
    at: Sequence[object] = setting("meshing.at")
    level: int | None = setting("meshing.level")
    max_hexes: int = setting("meshing.max_hexes")

    def __call__(self, surface: TriMesh, candidates: tuple[Candidate, ...]) -> list[Candidate]:
        """One candidate with hexes; none if the part has no such section, or good hexes already."""
        from polycube.hexmesh.background.background import NoBackgroundError
        from polycube.hexmesh.generation.blocks import candidate
        from polycube.hexmesh.generation.requests_met import missing
        from polycube.surface.measures import volume

        brick = full_cell(self.primitives)
        if brick is None:
            logger.info("%s: no primitive is a full cell; nothing is proposed", self.proposal)
            return []
        if any(_is_good(each) for each in candidates if each.tier == self.tier):
            logger.info("%s: there are good hexes already; nothing is proposed", self.proposal)
            return []
        try:
            sizes = self._sizes(surface)
            if volume(surface) > self.max_hexes * sizes.size**3:
                raise NoBackgroundError(f"it needs more than max_hexes {self.max_hexes}")
            blocks = self.hexes(surface, sizes)
            if len(blocks.hexes) > self.max_hexes:
                raise NoBackgroundError(f"it needs more than max_hexes {self.max_hexes}")
            if self.at and max(missing(blocks, surface, requests_of(self.at))) > 0:
                raise NoBackgroundError("it does not have the numbers of hexes of meshing.at")
        except NoBackgroundError as reason:
            logger.info("%s: nothing is proposed, because %s", self.proposal, reason)
            return []
        found = candidate(blocks, surface, brick, self.proposal)
        return [replace(found, tier=self.tier, variants="sweep")]

    def _sizes(self, surface: TriMesh) -> Sizes:
        """Wanted sizes of the quads."""
        from polycube.hexmesh.background.curves import Sizes
        from polycube.hexmesh.generation import sizing
        from polycube.surface.measures import diagonal

        unit, chord = diagonal(surface), np.inf
        size = sizing.length(self.size, unit) / 2 ** (self.level or 0)
        if self.curvature is not None:
            exact = features_of(self.features, surface) == "exact"
            chord = sizing.length(curvature_of(self.curvature, exact), unit)
        wanted = [(each.kind, each.wanted(surface)) for each in requests_of(self.at)]
        size = min([size, *(value for kind, value in wanted if kind == "size")])
        through = [value for kind, value in wanted if kind == "through"]
        around: float | str = self.around_hole
        if rims := [value for kind, value in wanted if kind == "around"]:
            around = max(*rims, edges_around(self.around_hole))
        return Sizes(size, chord, max([self.across_wall, *through]), around)

    @abstractmethod
    def hexes(self, surface: TriMesh, sizes: Sizes) -> HexMesh:
        """The hexes of a part; raises NoBackgroundError if it has no such section."""


def _is_good(candidate: Candidate) -> bool:
    """Whether a candidate has exact hexes of a good shape."""
    from polycube.hexmesh.scaled_jacobian import scaled_jacobian

    mesh = candidate.blocks
    return mesh is not None and bool(scaled_jacobian(mesh.vertices, mesh.hexes).min() > GOOD)
