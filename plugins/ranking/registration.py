"""Rank proposed structures by the fit of a coarse mesh after a short registration."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import numpy as np

from polycube.registry import register
from polycube.types import Candidate, HexMesh, PerAxis, Ranked, Tier, TriMesh

if TYPE_CHECKING:
    from polycube.fitting.registration import ShortQuality
    from polycube.surface.fit_target import Target

logger = logging.getLogger(__name__)

COLUMNS = ("to_surface", "to_mesh", "min_jacobian", "volume_ratio")


@register("ranking", "registration")
@dataclass(frozen=True)
class Registration:
    """Fit a coarse mesh of each candidate by a short registration, and measure it.

    Structures with another genus than the surface are not ranked. The score is the sum of the
    distances in per cent of the diagonal (98th percentile, both directions), penalties for bad
    hexes and a wrong volume, for corners of the polycube, and for curves of a CAD part without a
    path of mesh edges, and the cost given by the proposal. Smaller scores are better. Lattices with
    cells of the size of the hexes are not registered and keep their order; their score is infinite,
    as is that of the only structure if it has blocks, because there is nothing to choose between.
    A structure with more than `boxes` boxes is not ranked, because it is not coarse.

    Parameters
    ----------
    size : edge length of the coarse hexes, as a share of the diagonal
    rounds : number of rounds of the short registration
    iterations : number of steps in each round
    samples : number of points of the surface that are matched with the mesh
    trust : score for each unit of cost above the cheapest candidate of the same proposal
    corner : score for each corner beyond the eight of a box; hexes are skewed at corners that the
        part does not have
    lost : score if all curves of a CAD part have no path of mesh edges; proportional to their share
    limit : largest number of registered candidates of each proposal; the cheapest are taken
    boxes : largest number of boxes of a registered polycube
    """

    size: float = 0.08
    rounds: int = 7
    iterations: int = 15
    samples: int = 1500
    trust: float = 15.0
    corner: float = 0.03
    lost: float = 5.0
    limit: int = 12
    boxes: int = 2000

    def __call__(self, surface: TriMesh, candidates: Iterable[Candidate]) -> list[Ranked]:
        """Candidates of the correct genus, or last resorts; the best first, one per rough map."""
        from polycube.hexmesh.generation.blocks import genus_of
        from polycube.structure.lattice import is_manifold
        from polycube.surface import measures as surfaces
        from polycube.surface.fit_target import target

        goal, wanted = target(surface), surfaces.genus(surface)
        distinct = {id(candidate.rough_map): candidate for candidate in candidates}.values()
        solid = [c for c in distinct if is_manifold(c.polycube)]
        same = [c for c in solid if genus_of(c.polycube, c.blocks) == wanted]
        ranked = []
        coarse = self._coarse([c for c in same if c.tier < Tier.FINE])
        if len(coarse) == 1 and coarse[0].tier == Tier.EXACT and coarse[0].blocks is not None:
            ranked, coarse = [_unregistered(coarse[0])], []
        for proposal in dict.fromkeys(c.proposal for c in coarse):
            own = sorted((c for c in coarse if c.proposal == proposal), key=lambda c: c.cost)
            ranked += [self._scored(c, goal, own[0].cost) for c in own[: self.limit]]
        ranked.sort(key=lambda entry: entry.score)
        ranked += [_unregistered(c) for c in same if c.tier == Tier.FINE]
        ranked += [_unregistered(c) for c in solid if c.tier == Tier.LAST]
        _log(ranked)
        return ranked

    def _coarse(self, candidates: list[Candidate]) -> list[Candidate]:
        """Candidates with blocks, or with few boxes."""
        sizes = [0 if c.blocks is not None else int(c.polycube.occupancy.sum()) for c in candidates]
        found = [c for c, size in zip(candidates, sizes, strict=True) if size <= self.boxes]
        if len(found) < len(candidates):
            message = "%d structures are not ranked: the largest has %d boxes, the limit is %d"
            logger.info(message, len(candidates) - len(found), max(sizes), self.boxes)
        return found

    def _scored(self, candidate: Candidate, goal: Target, cheapest: float) -> Ranked:
        """A candidate with its score and its coarse mesh."""
        from polycube.fitting.registration import matched_curves, register_mesh, short_quality
        from polycube.hexmesh.generation import blocks
        from polycube.hexmesh.generation.template import counts
        from polycube.structure.lattice import boundary, corners

        polycube, size = candidate.polycube, self.size * goal.scale
        if candidate.blocks is not None:
            coarse = blocks.cut(candidate.blocks, blocks.counts(candidate.blocks, size))
            positions = blocks.on_box(coarse.vertices)
        else:
            coarse, positions = _divided(candidate, counts(polycube, candidate.rough_map, size))
        exact = goal.features.n_faces > 0
        effort = self.rounds, self.iterations, self.samples
        hexes = register_mesh(coarse, goal, *effort, features=exact)
        quality = short_quality(hexes, goal)
        score = short_score(quality) + self.trust * (candidate.cost - cheapest)
        score += self.corner * (len(corners(boundary(polycube))) - 8)
        if exact:
            number = len(goal.followed.creases)
            score += self.lost * (1 - matched_curves(hexes, goal) / max(number, 1))
        return Ranked(candidate, score, asdict(quality), hexes, positions)


def _unregistered(candidate: Candidate) -> Ranked:
    """A candidate with its blocks or the boxes of its lattice as hexes, and an infinite score."""
    from polycube.hexmesh.generation.blocks import on_box

    if (blocks := candidate.blocks) is not None:
        return Ranked(candidate, np.inf, {}, blocks, on_box(blocks.vertices))
    x, y, z = (np.ones(n, np.int64) for n in candidate.polycube.occupancy.shape)
    return Ranked(candidate, np.inf, {}, *_divided(candidate, (x, y, z)))


def _divided(candidate: Candidate, parts: PerAxis) -> tuple[HexMesh, np.ndarray]:
    """Hexes of the lattice with parts of each interval, and their vertices on the polycube."""
    from polycube.hexmesh.generation.template import mesh
    from polycube.structure.rough_map import identity_map

    polycube = candidate.polycube
    on_polycube = mesh(polycube, identity_map(polycube), parts).vertices
    return mesh(polycube, candidate.rough_map, parts), on_polycube


def short_score(quality: ShortQuality) -> float:
    """Score of a mesh after a short registration; smaller is better."""
    return (
        quality.to_surface
        + quality.to_mesh
        + 60 * quality.bad
        + 8 * (1 - quality.mean_jacobian)
        + 15 * max(0.0, abs(quality.volume_ratio - 1) - 0.03)
        + 1
        - min(max(quality.min_jacobian, -1.0), 0.5)
    )


def _log(ranked: list[Ranked]) -> None:
    from polycube.structure.lattice import describe

    columns = "score, distances to surface and mesh [% of diagonal], min Jacobian, volume"
    logger.info("ranking: %s", columns)
    for entry in ranked:
        polycube, blocks = entry.candidate.polycube, entry.candidate.blocks
        name = describe(polycube) if blocks is None else f"{len(blocks.hexes)} blocks"
        numbers = [entry.score, *(entry.numbers.get(key, np.nan) for key in COLUMNS)]
        form = "  %6.2f %6.2f %6.2f %7.3f %6.3f  %-9s %s"
        logger.info(form, *numbers, entry.candidate.proposal, name)
