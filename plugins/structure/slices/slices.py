"""Find the structure from slices: every pattern of the correct genus, in every frame and axis.

The context of the cheapest alignment is proposed; alignments with a similar cost are also returned,
and a short registration decides between them.
"""

import logging
from dataclasses import dataclass

import numpy as np

from polycube.kinds import Structure
from polycube.registry import register
from polycube.types import Candidate, TriMesh

from .options import SliceOptions

logger = logging.getLogger(__name__)

AXES = np.array([np.roll(np.eye(3), -axis, axis=0) for axis in range(3)])  # with x, y or z first


@register("structure", "slices")
@dataclass(frozen=True, kw_only=True, eq=False)
class SliceMatching(SliceOptions, Structure):
    """Match slices of the part with patterns of slabs; for grids that are a row of cells.

    Parameters
    ----------
    margin : cost above the best, as a share of the volume, up to which a candidate is returned
    kept : largest number of candidates of the best frame
    kept_elsewhere : largest number of candidates of every other frame
    """

    margin: float = 0.25
    kept: int = 5
    kept_elsewhere: int = 3

    def __call__(self, surface: TriMesh, candidates: tuple[Candidate, ...]) -> list[Candidate]:
        """Candidates, cheapest first; empty if the grid is no row or no context has the genus."""
        from polycube.structure.lattice import genus as genus_of
        from polycube.surface.measures import genus

        from .alignment import slab_patterns
        from .candidates import alignments, as_candidate, views

        if tuple(self.grid[1:]) != (1, 1):
            logger.info("slices: grid %s is not a row of cells; nothing is proposed", self.grid)
            return []
        wanted = genus(surface)
        every = slab_patterns(self.grid, self.primitives)
        fitting = [each for each in every if genus_of(each.polycubes[0]) == wanted]
        found: list[Candidate] = []
        for frame, view in enumerate(views(self, surface)):
            limit = self.kept_elsewhere if frame else self.kept
            aligned = alignments(self, view, AXES, fitting)
            found += self._close([as_candidate(r, "slices", frame) for r in aligned], limit)
        found = self._close(sorted(found, key=lambda candidate: candidate.cost), len(found))
        message = "slices: genus %d is that of %d of %d slab patterns"
        logger.info(message, wanted, len(fitting), len(every))
        for candidate in found[:1]:
            context = ", ".join(filter(None, candidate.polycube.context))
            message = "slices: %d candidates, best %s with cost %.3f"
            logger.info(message, len(found), context, candidate.cost)
        return found

    def _close(self, candidates: list[Candidate], limit: int) -> list[Candidate]:
        """The first `limit` within the margin of the first, and all with its structure."""
        return [
            candidate
            for rank, candidate in enumerate(candidates)
            if candidate.key == candidates[0].key
            or (rank < limit and candidate.cost <= candidates[0].cost + self.margin)
        ]
