"""Rank proposed structures by how well a coarse mesh of each fits after a short registration.

Structures whose genus is not the surface's never rank.  The score adds distances in per cent of
the diagonal (98th percentile, both ways), penalties for bad hexes and a wrong volume, the
polycube's corners, and what the proposal itself thought of the structure; smaller is better.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable
from dataclasses import asdict

import numpy as np

from polycube.fitting.registration import ShortQuality, register_mesh, short_quality
from polycube.hexmesh.quality import BEST_SCORE
from polycube.hexmesh.template import counts, mesh
from polycube.structure.lattice import boundary, corners, describe, genus, is_manifold
from polycube.structure.rough_map import identity_map
from polycube.surface import measures as surfaces
from polycube.surface.fit_target import target
from polycube.types import Candidate, HexMesh, Ranked, TriMesh

logger = logging.getLogger(__name__)

GOOD_SCORE = 0.4  # of a mesh, see `quality.score`: no other structure is tried
CLOSE = 1.15  # ratio of ranking scores within which either structure may be the better one


def rank(
    surface: TriMesh,
    candidates: Iterable[Candidate],
    *,
    size: float = 0.08,
    rounds: int = 7,
    iterations: int = 15,
    samples: int = 1500,
    trust: float = 15.0,
    corner: float = 0.03,
    limit: int = 12,
) -> list[Ranked]:
    """Candidates of the right genus, best first; of those that share a rough map, the last.

    size : of the coarse hexes, as a share of the diagonal
    rounds, iterations, samples : of the short registration
    trust : score per unit of a candidate's cost above the cheapest of its proposal
    corner : score per corner beyond a box's eight: hexes are skewed there unless the part has one
    limit : candidates registered of each proposal, the cheapest
    """
    goal, wanted = target(surface), surfaces.genus(surface)
    distinct = {id(candidate.rough_map): candidate for candidate in candidates}.values()
    fitting = [c for c in distinct if is_manifold(c.polycube) and genus(c.polycube) == wanted]
    ranked = []
    for proposal in dict.fromkeys(c.proposal for c in fitting):
        ours = sorted((c for c in fitting if c.proposal == proposal), key=lambda c: c.cost)[:limit]
        for candidate in ours:
            coarse, positions = _coarse(candidate, size * goal.scale)
            hexes = register_mesh(coarse, goal, rounds, iterations, samples)
            quality = short_quality(hexes, goal)
            score = judge(quality) + trust * (candidate.cost - ours[0].cost)
            score += corner * (len(corners(boundary(candidate.polycube))) - 8)
            ranked.append(Ranked(candidate, score, asdict(quality), hexes, positions))
    ranked.sort(key=lambda entry: entry.score)
    _log(ranked)
    return ranked


def judge(quality: ShortQuality) -> float:
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


def worth_a_try(ranked: list[Ranked], tries: int) -> list[int]:
    """The best structure, the best of the other family, then the best of each other kind.

    As long as the score is within twice the best's.  Families are lattices of bricks, and the
    contexts of a grid: where one fits badly, the other is the better guess.
    """
    seen, choices = set(), []
    for index, entry in enumerate(ranked):
        if entry.candidate.key not in seen and entry.score <= 2 * ranked[0].score + 2:
            seen.add(entry.candidate.key)
            choices.append(index)
    other = [i for i in choices if _family(ranked[i]) != _family(ranked[choices[0]])]
    first = choices[:1] + other[:1]
    return [*first, *(i for i in choices if i not in first)][:tries]


def enough(ranked: list[Ranked], choices: list[int], index: int) -> float:
    """Score of a mesh of the ranked structure `index` after which no later choice is tried.

    The best of all where a rival of the other family ranks close: there a short registration
    does not tell (hepta: 5.0 against 5.6, but the mesh of the second misses by a third).
    """
    now, *later = (ranked[i] for i in choices[choices.index(index) :])
    is_close = any(
        entry.score <= CLOSE * now.score and _family(entry) != _family(now) for entry in later
    )
    return BEST_SCORE if is_close else GOOD_SCORE


def _family(entry: Ranked) -> str:
    return entry.candidate.family


def _coarse(candidate: Candidate, size: float) -> tuple[HexMesh, np.ndarray]:
    """Hexes of a candidate of about the given size in model units, and their polycube positions."""
    polycube = candidate.polycube
    parts = counts(polycube, candidate.rough_map, size)
    positions = mesh(polycube, identity_map(polycube), parts).vertices
    return mesh(polycube, candidate.rough_map, parts), positions


def _log(ranked: list[Ranked]) -> None:
    logger.info(
        "ranking: score, distance to surface, to mesh [% of diagonal], min Jacobian, volume"
    )
    for entry in ranked:
        n = entry.numbers
        logger.info(
            "  %6.2f %6.2f %6.2f %7.3f %6.3f  %-9s %s",
            entry.score,
            n["to_surface"],
            n["to_mesh"],
            n["min_jacobian"],
            n["volume_ratio"],
            entry.candidate.proposal,
            describe(entry.candidate.polycube),
        )
