"""Propose polycubes from labels of the surface."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from polycube.kinds import Structure
from polycube.registry import register
from polycube.structure.primitives import OnGrid, full_cell
from polycube.types import Candidate, TriMesh

if TYPE_CHECKING:
    from .descent import Labelling
    from .lattices import View
    from .pieces import Pieces

logger = logging.getLogger(__name__)

MOST = 800  # largest number of pieces for the search
FEW = 150  # the same for a CAD part with few planes, whose lattices are large


@register("structure", "labels")
@dataclass(frozen=True, kw_only=True, eq=False)
class LabelLattice(OnGrid, Structure):
    """Label each face of the part with one of six directions and place its charts on a lattice.

    Slanted planes stay one face or are divided in halves, so that slots, wedges and pockets with
    slanted walls have their own bricks. It needs faces of a CAD file, or planes.

    Parameters
    ----------
    frames : largest number of coordinate frames that are tried
    compactness : values tried: cost of a border between labels, per diagonal of its length
    planar : share of the area in planes below which nothing is proposed for triangle surfaces and
        for CAD parts with many faces
    size : edge length of the triangles that carry the coordinates, as a share of the diagonal
    least : smallest distance of charts that face each other, as a share of the diagonal
    apart : knots closer than this share of the diagonal are merged if no feature is lost
    smoothness : smoothness of the rough map
    kicks : number of restarts of the search after labels without faults were found
    budget : largest number of evaluations of the energy of labels, for each frame and compactness
    kept : largest number of candidates for each frame
    bricks : largest number of bricks of a lattice, full or empty; larger lattices are not coarse
    """

    any_grid = True

    frames: int = 1
    compactness: Sequence[float] = (0.03, 0.005)
    planar: float = 0.3
    size: float = 0.05
    least: float = 0.02
    apart: float = 0.03
    smoothness: float = 0.03
    kicks: int = 8
    budget: int = 200_000
    kept: int = 3
    bricks: int = 15_000

    def __call__(self, surface: TriMesh, candidates: tuple[Candidate, ...]) -> list[Candidate]:
        """Candidates, cheapest first; empty if no labels without faults are found."""
        from .lattices import views
        from .pieces import pieces

        brick = full_cell(self.primitives)
        if brick is None:
            logger.info("labels: no primitive is a full cell; nothing is proposed")
            return []
        made: list[Candidate] = []
        for view in views(surface, self.frames):
            own = pieces(view.surface, self.size)
            most = MOST if own.planar >= self.planar else FEW if len(surface.region) else 0
            if most == 0:
                logger.info("labels: %.0f %% of the area is planar", 100 * own.planar)
                continue
            if len(own.face) > most:
                message = "labels: nothing is proposed, because %d pieces are too many"
                logger.info(message, len(own.face))
                continue
            made += self._in_view(own, view, brick)
        return sorted(made, key=lambda candidate: candidate.cost)

    def _in_view(self, pieces: Pieces, view: View, brick: str) -> list[Candidate]:
        """Candidates of a part in a frame."""
        from .lattices import OnBricks
        from .placement import placement

        found: dict[str, Candidate] = {}
        for entry in self._labellings(pieces):
            if len(found) == self.kept:
                break
            own = placement(pieces, entry.label, view.genus, self.least, self.apart)
            if own is None:
                continue
            full, knots = own[0].full, own[0].knots
            if full.size > self.bricks:
                message = "labels: a lattice of %d bricks, full or empty, is too large"
                logger.info(message, full.size)
                break
            on = OnBricks(full, knots, pieces.surface, own[1])
            made = on.candidate("labels", view, self.smoothness, entry.cost, brick)
            found.setdefault(made.key, made)
        message = "labels: frame %d, %d pieces, %d candidates"
        logger.info(message, view.number, len(pieces.face), len(found))
        return list(found.values())

    def _labellings(self, pieces: Pieces) -> list[Labelling]:
        """Different labels of the pieces, the cheapest of each compactness first."""
        from .descent import labellings
        from .energy import problem
        from .pieces import arcs

        borders = arcs(pieces)
        found: dict[bytes, Labelling] = {}
        for compactness in self.compactness:
            energy = problem(pieces, borders, compactness)
            generator = np.random.default_rng(0)
            for entry in labellings(pieces, energy, self.kicks, self.budget, generator):
                found.setdefault(entry.label.tobytes(), entry)
        return list(found.values())
