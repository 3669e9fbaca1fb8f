"""Hexes of the polycube, positioned by its rough map."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np

from polycube.hexmesh import settings
from polycube.hexmesh.generation import sizing
from polycube.hexmesh.generation.requests import requests_of
from polycube.registry import register, setting
from polycube.surface.measures import diagonal
from polycube.types import HexMesh, Polycube, RoughMap, TriMesh
from polycube.types.options import Count, Options, Positive, limits

if TYPE_CHECKING:
    from polycube.hexmesh.generation.interval_counts import Lattice
    from polycube.surface.fit_target import Target

logger = logging.getLogger(__name__)

QUICK = 7, 15, 1500  # rounds, iterations, samples: for the curvature of the surface
NO_REGIONS = "meshing.regions has no effect on blocks; meshing.size makes all hexes smaller"
DEEPEST = 10  # octree level: about a thousand parts of every interval


@register("meshing/subdivide", "template")
@dataclass(frozen=True)
class Template(Options):
    """Cut every interval of the polycube's lattice into equal parts.

    Fine hexes are placed by a cascade of coarser ones that were registered first.

    Parameters
    ----------
    size : wanted edge length, in the units of the model or as a share of the diagonal
    level : number of parts of every lattice interval as 2^level, as in the paper; null: the number
        follows from `size`
    regions : boxes with smaller hexes: [{box: [x, y, z, X, Y, Z], size: 1%}]
    curvature : largest chord error on curved surfaces; above it there are more parts; auto: 0.3%,
        or 0.2% with exact features; null: no limit
    finer : the size is divided by this, and the chord error by its square where it is above 1;
        variants of the search change it
    coarse : size from which finer hexes are placed by registered coarser ones
    least : smallest number of parts of a lattice interval
    across : smallest number of parts along each axis of the whole lattice
    max_hexes : largest number of hexes before pillowing; a size that needs more is refused
    at : numbers of hexes at faces: [{at: hole_1, around: 16}, {at: cad_WEB, through: 3}]; they
        determine the number of parts of the lattice intervals there, whatever the size
    more : additional parts (fewer if negative) for each entry of `at`; set by the search
    creases : largest chord error along sharp edges; above it the intervals along them get more
        parts, up to half as many hexes again; null: no limit; set by the search
    features : exact, soft, off or auto; exact: coarser meshes are registered with the curves fixed
    coarsen : with level 0: make hexes larger than those of the lattice where no detail needs small
        ones, up to about `size`
    across_wall : smallest number of hexes through every wall, before layers under the boundary
    around_hole : smallest number of edges round every hole, before layers under the boundary
    """

    size: sizing.Length = setting("meshing.size")
    level: Annotated[int, limits(0, DEEPEST)] | None = setting("meshing.level")
    regions: Sequence[object] = setting("meshing.regions")
    curvature: sizing.Length | Literal["auto"] | None = setting("meshing.curvature")
    finer: Positive = 1.0
    coarse: sizing.Length = "5%"
    least: Count = 2
    across: Count = 4
    max_hexes: Count = setting("meshing.max_hexes")
    at: Sequence[object] = setting("meshing.at")
    more: Sequence[int] = ()
    creases: sizing.Length | None = None
    features: settings.Features = setting("meshing.features")
    coarsen: bool = False
    across_wall: settings.AcrossWall = setting("meshing.across_wall")
    around_hole: settings.AroundHole = setting("meshing.around_hole")

    def __call__(
        self,
        surface: TriMesh,
        polycube: Polycube,
        rough_map: RoughMap,
        blocks: HexMesh | None = None,
    ) -> HexMesh:
        """Conforming hexes, not yet on the surface; `patch` is the number of the polycube face.

        Blocks are divided instead of the polycube, each into equal parts; only `size`, `finer`,
        `across_wall` and `level` are used for them.

        Raises MeshingError if more than `max_hexes` are requested.
        """
        from polycube.fitting.creases.chord_counts import finer_along
        from polycube.fitting.registration import cascade, register_mesh, registered_map
        from polycube.hexmesh.generation.interval_counts import Lattice
        from polycube.hexmesh.generation.template import counts, mesh, mesh_between
        from polycube.surface.fit_target import target

        goal, unit = target(surface), diagonal(surface)
        size = sizing.length(self.size, unit) / self.finer
        if blocks is not None:
            return self._cut(blocks, size)
        boxes = [sizing.box_of(region, unit) for region in self.regions]
        if self.coarsen and self.level == 0:
            from polycube.hexmesh.generation.graded_template import graded_mesh
            from polycube.hexmesh.generation.requests_met import wanted_sizes

            largest = sizing.length(self.size, unit)
            number = self.across_wall, settings.edges_around(self.around_hole)
            wanted = wanted_sizes(surface, requests_of(self.at))
            found = graded_mesh(polycube, rough_map, goal, largest, *number, boxes, wanted)
            if found is not None:
                return found

        def parts_at(size: float) -> sizing.Counts:
            return counts(polycube, rough_map, size, self.least, self.across)

        def number_at(size: float) -> float:
            return sizing.number_of_hexes(polycube, parts_at(size))

        parts = parts_at(size)
        if self.level is not None:
            x, y, z = (np.full(n, 2**self.level) for n in polycube.occupancy.shape)
            parts = x, y, z
        self._check_max_hexes(sizing.number_of_hexes(polycube, parts), size, number_at)
        coarse = sizing.length(self.coarse, unit)
        exact = settings.features_of(self.features, surface) == "exact"
        placed = rough_map  # an undivided lattice has no coarser one
        if self.level != 0:
            placed = cascade(polycube, rough_map, goal, size, coarse, exact)
        is_curved = self.curvature is not None and self.level is None
        is_followed = self.creases is not None and self.level is None
        if is_curved or self._has_requests or is_followed:
            few = parts_at(max(size, coarse))
            near = register_mesh(mesh(polycube, placed, few), goal, *QUICK, features=exact)
            lattice = Lattice(polycube, near, few)
            if is_curved:
                parts = self._curved(lattice, goal, parts, few, exact)
            if self._has_requests:
                parts = self._demanded(surface, lattice, parts)
            if is_followed:
                chord = sizing.length(self.creases, unit) / unit
                parts = finer_along(lattice, parts, goal, chord, self.max_hexes)
        if not self.regions:
            return mesh(polycube, placed, parts)
        if placed is rough_map:  # the boxes are in model coordinates, so a good map is needed
            placed = registered_map(polycube, rough_map, goal, parts_at(coarse), exact)
        lines = sizing.graded(polycube, placed, parts, boxes)
        fine = sizing.counts_of(polycube, lines)
        self._check_max_hexes(sizing.number_of_hexes(polycube, fine), size, number_at)
        return mesh_between(polycube, placed, lines)

    def finer_options(self, times: float) -> dict[str, object] | None:
        """Options for hexes smaller by a factor, with a chord error reduced accordingly."""
        return None if self.level is not None else {"finer": times * self.finer}

    def crease_options(self, distance: float) -> dict[str, object] | None:
        """Options for chords within a distance of the sharp edges, in diagonals."""
        return None if self.level is not None else {"creases": f"{100 * distance:.9g}%"}

    def count_options(self, missing: Sequence[int]) -> dict[str, object] | None:
        """Options for additional or fewer hexes at each entry of `at`."""
        if self.level == 0:
            return None
        before = self.more or [0] * len(missing)
        return {"more": [a + b for a, b in zip(before, missing, strict=True)]}

    @property
    def _has_requests(self) -> bool:
        """Whether there are requests that the smallest numbers of parts do not meet."""
        around = settings.edges_around(self.around_hole)
        is_more = self.across_wall > self.least or around >= 4 * self.least
        return self.level != 0 and (bool(self.at) or is_more)

    def _demanded(self, surface: TriMesh, lattice: Lattice, parts: sizing.Counts) -> sizing.Counts:
        """Parts for the requested numbers of hexes, within max_hexes."""
        from polycube.hexmesh.generation import interval_counts as counts

        polycube, most = lattice.polycube, self.max_hexes
        requested = counts.demands(lattice, surface, requests_of(self.at), self.more)
        size = sizing.length(self.size, diagonal(surface))
        around = partial(settings.edges_around, self.around_hole, size=size)
        least = counts.least_demands(lattice, surface, self.across_wall, around, requested)
        parts = counts.with_demands(polycube, parts, requested, most)
        return counts.raised(polycube, parts, least, most)

    def _curved(
        self, lattice: Lattice, goal: Target, parts: sizing.Counts, few: sizing.Counts, exact: bool
    ) -> sizing.Counts:
        """More parts in curved regions, from a mesh of a few parts; within max_hexes."""
        from polycube.fitting.creases import chord_counts as chords

        assert self.curvature is not None
        polycube = lattice.polycube
        gap = chords.gaps(polycube, lattice.near, few, goal)
        chord = sizing.length(settings.curvature_of(self.curvature, exact), goal.scale)
        wanted = chord / goal.scale / max(1.0, self.finer) ** 2
        more = chords.finer(polycube, parts, few, gap, wanted)
        number, old = (sizing.number_of_hexes(polycube, n) for n in (more, parts))
        if number == old or number > self.max_hexes:
            return parts
        logger.info("subdivide: %.0f additional hexes on curved surfaces", number - old)
        return more

    def _cut(self, given: HexMesh, size: float) -> HexMesh:
        """Divide blocks into parts of the size, or into 2^level."""
        from polycube.hexmesh.generation import blocks

        def parts_of(size: float) -> np.ndarray:
            # a convex cell has two blocks from one face to another
            return np.maximum(blocks.counts(given, size), int(np.ceil(self.across_wall / 2)))

        parts = parts_of(size)
        if self.level is not None:
            parts = np.full_like(parts, 2**self.level)
        self._check_max_hexes(
            blocks.number_of_hexes(parts), size, lambda s: blocks.number_of_hexes(parts_of(s))
        )
        found = blocks.cut(given, parts)
        return replace(found, warnings=(NO_REGIONS,)) if self.regions else found

    def _check_max_hexes(
        self, number: float, size: float, number_at: Callable[[float], float]
    ) -> None:
        request = f"size {size:.4g}" if self.level is None else f"level {self.level}"
        sizing.check_number(number, self.max_hexes, request, size, number_at, bool(self.regions))

    def __post_init__(self) -> None:
        super().__post_init__()
        for region in self.regions:
            sizing.box_of(region, 1.0)
        requests_of(self.at)
