"""Fit boxes to the voxels of a part: all contexts of any grid, including empty cells.

The bounding box of a polycube is placed on that of the part, and its inner knots where they fit
best. The shapes of the grid are first tried in all rotations with few voxels; the best of them are
fitted again with more voxels.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from polycube.kinds import Structure
from polycube.registry import register
from polycube.types import Candidate, Polycube, RoughMap, TriMesh

if TYPE_CHECKING:
    from .slices.alignment import View

logger = logging.getLogger(__name__)

Trial = tuple[Polycube, np.ndarray, int]  # shape, rotation (3, 3) from the frame to its axes, frame

STARTS = 9  # starts of the final search for knots


@register("structure", "boxes")
@dataclass(frozen=True, kw_only=True, eq=False)
class BoxFitting(Structure):
    """Fit boxes to the voxels of the part; for any grid, also shapes such as L, T, U.

    Nothing is proposed where another plugin has found candidates on the same grid.

    Parameters
    ----------
    grid : cells of the polycube along x, y, z
    primitives : (3, 3, 3) bool voxels by name
    resolution : voxels along the longest side of the part
    rough : voxels along the longest side in the first search, in which all shapes are tried
    frames : largest number of coordinate frames that are tried
    tried : largest number of shapes that are tried; those with the fewest boxes come first
    knot : cost of an inner knot, as a share of the volume
    kept : largest number of candidates
    """

    grid: tuple[int, int, int]
    primitives: Mapping[str, np.ndarray]
    resolution: int = 96
    rough: int = 32
    frames: int = 2
    tried: int = 40
    knot: float = 0.01
    kept: int = 6

    def __call__(self, surface: TriMesh, candidates: tuple[Candidate, ...]) -> list[Candidate]:
        """Candidates, cheapest first.

        The list is empty if no context has the genus of the surface, and if there are earlier
        candidates for the grid, because slices give a better placement for a row of cells.
        """
        from polycube.surface import measures as surfaces
        from polycube.surface.frames import frames
        from polycube.surface.voxels import voxels

        from .slices.alignment import View
        from .slices.candidates import distinct_turns

        if candidates:
            return []
        every = frames(surface, self.frames)
        trials = [
            (shape, rotation, frame)
            for shape in self._shapes(surfaces.genus(surface))
            for rotation in distinct_turns(shape)
            for frame in range(len(every))
        ]
        rough, fine = (
            [View(frame, np.eye(3), voxels(surface, frame, resolution)) for frame in every]
            for resolution in (self.rough, self.resolution)
        )
        rough_fits = self._fitted(rough, trials, 1)
        found = self._fitted(fine, [trial for _, trial in rough_fits[: 2 * self.kept]], STARTS)
        logger.info(
            "boxes: %d placements tried, %d of them with the fine voxels",
            len(rough_fits),
            len(found),
        )
        return [candidate for candidate, _ in found[: self.kept]]

    def _shapes(self, wanted: int) -> list[Polycube]:
        """Polycubes of a genus that differ in all rotations, those with the fewest boxes first."""
        from polycube.diffusion.pairs.templates import contexts
        from polycube.structure.lattice import collapse, genus, lattice
        from polycube.surface.frames import rotations

        from .slices.candidates import structure_key

        named = sorted(contexts(self.grid, self.primitives), key=lambda c: -c.count(None))
        solids = [collapse(lattice(self.grid, context, self.primitives)) for context in named]
        solids.sort(key=lambda solid: solid.occupancy.size)
        distinct: dict[str, Polycube] = {}
        for solid in solids:
            if len(distinct) < self.tried and genus(solid) == wanted:
                distinct.setdefault(min(structure_key(solid, r, 0) for r in rotations()), solid)
        return list(distinct.values())

    def _fitted(
        self, views: list[View], trials: list[Trial], starts: int
    ) -> list[tuple[Candidate, Trial]]:
        """Candidates of the possible placements, cheapest first."""
        found = [
            (candidate, (shape, rotation, frame))
            for shape, rotation, frame in trials
            for candidate in boxed(
                shape, views[frame], [rotation], frame, "boxes", starts, self.knot
            )
        ]
        return sorted(found, key=lambda pair: pair[0].cost)


def boxed(
    polycube: Polycube,
    view: View,
    turns: Iterable[np.ndarray],
    frame: int,
    proposal: str,
    starts: int = STARTS,
    knot: float = 0.0,
) -> list[Candidate]:
    """The polycube on the part in each rotation (3, 3) from the view to its axes.

    The cost is the volume filled by only one of the two, as a share of the volume of the part, and
    `knot` for each inner knot. Rotations in which the part has fewer voxels than the polycube has
    slabs are omitted.
    """
    from polycube.surface.frames import turn

    from .slices.candidates import structure_key
    from .slices.knots import cumulative, fit_knots

    solid = view.voxels.solid[1:-1, 1:-1, 1:-1]
    counts = cumulative(solid)
    inner = sum(polycube.occupancy.shape) - 3
    found = []
    for rotation in turns:
        slabs = turn(polycube.occupancy, rotation.T)
        if (np.array(slabs.shape) > solid.shape).any():
            continue
        knots, misfit = fit_knots(slabs, counts, starts)
        corners = np.meshgrid(*[k + 1 for k in knots], indexing="ij")
        at = np.stack([turn(corner, rotation) for corner in corners], axis=-1)
        rough_map = RoughMap(*polycube.knots, view.to_model(at))
        cost = float(misfit / solid.sum()) + knot * inner
        key = structure_key(polycube, rotation, frame)
        found.append(Candidate(proposal, polycube, rough_map, cost, key))
    return found
