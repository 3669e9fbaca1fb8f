"""Structures of any part, without a grid: lattices made from random draws of a network.

A draw predicts the axis of the polycube face of each point of the part, and its place on the
polycube. `knots.on_bricks` makes a lattice from these predictions.
"""

from __future__ import annotations

import logging
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from polycube.kinds import Structure
from polycube.registry import choice, register, setting
from polycube.structure.primitives import OnGrid, full_cell
from polycube.types import Candidate, Polycube, Tier, TriMesh

if TYPE_CHECKING:
    from polycube.diffusion.denoiser import Denoiser

    from ..labels.lattices import View
    from .knots import Lattice

logger = logging.getLogger(__name__)


@register("structure", "drawn")
@dataclass(frozen=True, kw_only=True, eq=False)
class Drawn(OnGrid, Structure):
    """Draw structures of any kind with the network that is trained without a grid.

    The charts of every second draw are flattened, which straightens bent parts.

    Parameters
    ----------
    weights : weights of a training with grid=any; null: the included weights
    draws : number of draws of the network in each frame
    clouds : number of sets of sample points in each draw
    passes : largest number of passes of the network; two draws have one pass, the next two have
        two, and so on; the input of a further pass is the part as moved by the pass before
    sampler : sampler of each pass; with one step or without noise, draws differ only in their
        sample points
    frames : largest number of coordinate frames that are tried
    size : edge length of the triangles that carry the coordinates, as a share of the diagonal
    smoothness : smoothness of the rough map
    bricks : largest number of bricks of a lattice, full or empty; one with more is not coarse
    faces : largest number of CAD faces; the sample points do not resolve more
    seed : seed of the sample points and the sampler
    """

    references: ClassVar[tuple[str, ...]] = ("ho2020ddpm",)

    any_grid = True
    needs_network = True
    tier = Tier.LEARNED

    weights: str | None = setting("ckpt", None)
    draws: int = 8
    clouds: int = 6
    passes: int = 2
    sampler: Mapping[str, object] = choice("sampler", "ddim")
    frames: int = 1
    size: float = 0.05
    smoothness: float = 0.03
    bricks: int = 15_000
    faces: int = 100
    seed: int = setting("seed", 0)

    def __call__(self, surface: TriMesh, candidates: tuple[Candidate, ...]) -> list[Candidate]:
        """One candidate for each structure that was drawn, the most frequent first.

        Its probability is its share of the draws. The list is empty if the user chooses the
        context, and for a part with too many CAD faces.
        """
        from ..labels.lattices import views
        from .hypotheses import denoiser_of_any

        n_faces = len(np.unique(surface.region))
        if n_faces > self.faces:
            message = "drawn: nothing proposed for %d CAD faces, the limit is %d"
            logger.info(message, n_faces, self.faces)
            return []
        brick = full_cell(self.primitives)
        if brick is None or any(candidate.proposal == "given" for candidate in candidates):
            return []
        denoiser = denoiser_of_any(self.weights)
        found = (self.in_view(denoiser, view, brick) for view in views(surface, self.frames))
        return [candidate for own in found for candidate in own]

    def in_view(self, denoiser: Denoiser, view: View, brick: str) -> list[Candidate]:
        """Candidates for a part in a frame, the most frequent first."""
        from polycube.diffusion.pairs.templates import shape_key

        from .knots import on_bricks

        fine, drawn = self._lattices(denoiser, view.surface, view.genus)
        found: dict[bytes, list[Lattice]] = defaultdict(list)
        for each in drawn:
            if each is not None and each.polycube.occupancy.size <= self.bricks:
                found[shape_key(each.polycube)].append(each)
        logger.info("drawn: %d structures in %d draws", len(found), self.draws)
        candidates = []
        for same in sorted(found.values(), key=len, reverse=True):
            share = len(same) / self.draws
            on = on_bricks(fine, same[0])
            candidate = on.candidate("drawn", view, self.smoothness, 1 - share, brick)
            candidates.append(replace(candidate, probability=share, tier=self.tier))
        return candidates

    def polycubes(self, denoiser: Denoiser, surface: TriMesh, genus: int) -> list[Polycube | None]:
        """Polycube of each draw for a surface of diagonal 1; None if it is not a solid."""
        _, drawn = self._lattices(denoiser, surface, genus)
        return [None if each is None else each.polycube for each in drawn]

    def _lattices(
        self, denoiser: Denoiser, surface: TriMesh, genus: int
    ) -> tuple[TriMesh, list[Lattice | None]]:
        """The refined surface, and the lattice of each draw; None for a draw without one."""
        from polycube.surface.edge_splits import refined

        from .draws import draw
        from .knots import lattice

        vertices, faces, _ = refined(surface.vertices, surface.faces, self.size)
        fine = TriMesh(vertices, faces)
        counts = self.draws, self.clouds, self.passes
        draws = draw(denoiser, fine, genus, self.sampler, *counts, self.seed)
        return fine, [lattice(fine, each, genus, bool(k % 2)) for k, each in enumerate(draws)]
