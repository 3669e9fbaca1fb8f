"""Choose among the ranked structures: which to mesh, in what order, and when to stop."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from polycube.kinds import Acceptance
from polycube.pipeline.state import RunState
from polycube.pipeline.variants import Options, Variants
from polycube.structure.parametrization import pull_back
from polycube.structure.recognition import read_structure
from polycube.types import DRAWN, OVERLAY, SPARE, SWEEP, Candidate, Polycube, Ranked

logger = logging.getLogger(__name__)

CLOSE = 1.15  # ratio of ranking scores within which either structure may be the better one
WITHOUT_OVERLAY = 0.3  # scaled Jacobian of a mesh without deficiencies: no overlay is tried
# scaled Jacobian of a mesh that is nearly all bricks: nothing is tried after a sweep, and no drawn
# structure
NEARLY_BRICKS = 0.9
MARGIN = 0.05  # log-likelihood per point by which another polycube must explain points better

Primitives = Mapping[str, np.ndarray]  # (3, 3, 3) voxels by name


def choose(state: RunState, index: int, primitives: Primitives) -> RunState:
    """The state in which the ranked structure `index` is the one that is meshed."""
    entry = state.ranked[index]
    state = replace(
        state,
        chosen=index,
        polycube=entry.candidate.polycube,
        rough_map=entry.candidate.rough_map,
        blocks=entry.candidate.blocks,
        parametrization=pull_back(state.surface, entry.hexes, entry.positions),
    )
    for candidate in (each.candidate for each in state.ranked):
        if candidate.key == entry.candidate.key and candidate.trajectory is not None:
            return replace(
                state,
                trajectory=candidate.trajectory,
                steps=candidate.steps,
                denoised_on=_denoised_on(candidate, candidate.trajectory[-1], primitives),
            )
    return replace(state, trajectory=None, steps=(), denoised_on=None)


def _denoised_on(
    candidate: Candidate, points: np.ndarray, primitives: Primitives
) -> Polycube | None:
    """The polycube on which denoised points lie; None if it is that of the candidate."""
    found = read_structure(points, candidate.polycube, primitives, MARGIN)
    if found is candidate.polycube:
        return None
    logger.info("denoised as %s, the points lie on %s", candidate.polycube.context, found.context)
    return found


def structures_to_mesh(ranked: Sequence[Ranked], tries: int) -> list[int]:
    """Numbers of the structures to mesh, in order.

    Drawn structures are meshed only if there is no other coarse one; see `drawn_to_compare`.
    """
    drawn = [i for i, entry in enumerate(ranked) if _family(entry) == DRAWN]
    others = [i for i in range(len(ranked)) if i not in drawn]
    order = [others[i] for i in _in_order([ranked[i] for i in others], tries)]
    if not drawn or any(not is_overlay(ranked[i]) for i in order):
        return order
    return [*drawn[:tries], *(i for i in order if _family(ranked[i]) == OVERLAY)]


def _in_order(ranked: Sequence[Ranked], tries: int) -> list[int]:
    """Numbers of the structures to mesh, in order, if there are no drawn ones.

    The order is: the best, the best of the other family, then the best of each other kind, if the
    score is at most about twice that of the best. Of equal structures with similar scores, the one
    of labels is taken, because its rough map is exact. `tries` limits the number of structures,
    with these exceptions. Structures with blocks come first if one of them ranks first, otherwise
    after these. Sweeps, which are meshed in seconds, come directly after the best structure; only a
    sweep that ranks first counts for `tries`. Overlays come after all others. Structures with
    another genus than the part are meshed only if there is nothing else.
    """
    spares = spares_of(ranked)
    if len(spares) == len(ranked):
        return spares
    ranked = ranked[: len(ranked) - len(spares)]
    overlays = [i for i, entry in enumerate(ranked) if is_overlay(entry)]
    if len(overlays) == len(ranked):
        return overlays
    seen, choices = set(), []
    for index, entry in enumerate(ranked[: len(ranked) - len(overlays)]):
        if entry.candidate.key not in seen and _is_near(ranked, index):
            seen.add(entry.candidate.key)
            same = (
                i
                for i, other in enumerate(ranked)
                if other.candidate.key == entry.candidate.key
                and other.candidate.family == "labels"
                and other.score <= CLOSE * entry.score
            )
            choices.append(next(same, index))
    sweeps = [i for i in choices if _family(ranked[i]) == SWEEP]
    blocks = [i for i in choices if ranked[i].candidate.blocks is not None and i not in sweeps]
    plain = [i for i in choices if i not in blocks + sweeps]
    others = [i for i in plain if _family(ranked[i]) != _family(ranked[plain[0]])]
    first = plain[:1] + others[:1]
    is_swept = choices[0] in sweeps
    tried = [*first, *(i for i in plain if i not in first)][: tries - is_swept]
    order = blocks + tried if choices[0] in blocks else tried + blocks
    return [*order[: not is_swept], *sweeps, *order[not is_swept :], *overlays]


def _is_near(ranked: Sequence[Ranked], index: int) -> bool:
    """Whether the score of a structure is within about twice that of the best."""
    return ranked[index].score <= 2 * ranked[0].score + 2


def sufficient_jacobian(
    ranked: Sequence[Ranked], choices: Sequence[int], index: int, acceptance: Acceptance
) -> float:
    """Scaled Jacobian of a mesh of structure `index` with which no later choice is tried.

    It is higher if a structure of another family has a similar score, because a short registration
    does not distinguish two such structures. A sweep is always tried, and another structure after
    a sweep unless the mesh is nearly all bricks.
    """
    now, *later = (ranked[i] for i in choices[choices.index(index) :])
    rivals = [each for each in later if not is_overlay(each)]
    if any(_family(each) == SWEEP for each in rivals):
        return np.inf
    if rivals and _family(now) == SWEEP:
        return NEARLY_BRICKS
    is_close = any(
        each.score <= CLOSE * now.score and _family(each) != _family(now) for each in rivals
    )
    return acceptance.excellent if is_close else acceptance.acceptable


def can_be_better(found: Variants, acceptance: Acceptance) -> bool:
    """Whether a drawn structure may have a better mesh than the structure found.

    That is not the case if the mesh found is nearly all bricks, or if its polycube is one brick and
    the mesh is excellent. For a hex mesh to improve there are no structures.
    """
    if not found.start.ranked or is_drawn(found.start):
        return False
    polycube = found.start.polycube
    is_one = polycube is not None and polycube.occupancy.size == 1
    limit = acceptance.excellent if is_one else NEARLY_BRICKS
    return found.reaches < limit or bool(found.taken().verdict.warnings)


def drawn_to_compare(ranked: Sequence[Ranked]) -> int | None:
    """Number of the drawn structure to compare with the one found; None if there is none.

    Of those with a score similar to that of the best drawn one, it is the one with the fewest full
    bricks.
    """
    drawn = [i for i, entry in enumerate(ranked) if _family(entry) == DRAWN]
    near = [i for i in drawn if _is_near(ranked, i)]
    close = [i for i in near if ranked[i].score <= CLOSE * ranked[near[0]].score]
    return min(close, key=lambda i: ranked[i].candidate.polycube.occupancy.sum(), default=None)


def is_unnecessary(entry: Ranked, made: Sequence[Variants]) -> bool:
    """Whether a structure need not be tried after the meshed ones.

    This holds for an overlay if a mesh meets all criteria and its smallest scaled Jacobian is at
    least `WITHOUT_OVERLAY`. Sharp edges of a surface without CAD faces are found by angle and do
    not justify so many hexes: there, an overlay is unnecessary if any mesh is valid.
    """
    meshed = [each for each in made if each.attempts]
    if not is_overlay(entry) or not meshed:
        return False
    best = max(meshed, key=lambda each: each.best).taken().verdict
    if not len(meshed[0].start.surface.region):
        return best.is_valid
    return best.reaches >= WITHOUT_OVERLAY


def variants_of(bundle: Mapping[str, Any], start: RunState) -> Sequence[Options]:
    """The variants for a structure: its own for overlays, blocks and sweeps, or the bundle's."""
    family = _family(start.ranked[start.chosen]) if start.ranked else ""
    own = {SWEEP: "sweep", OVERLAY: "overlay", SPARE: "overlay"}
    name = own.get(family, "portfolio" if start.blocks is None else "blocks")
    return bundle.get(name) or bundle["portfolio"]


def is_fine(start: RunState) -> bool:
    """Whether the structure that is meshed is an overlay."""
    return bool(start.ranked) and is_overlay(start.ranked[start.chosen])


def is_drawn(start: RunState) -> bool:
    """Whether the structure that is meshed was drawn by a network without a grid."""
    return bool(start.ranked) and _family(start.ranked[start.chosen]) == DRAWN


def has_coarse(ranked: Sequence[Ranked]) -> bool:
    """Whether one of the structures is coarser than an overlay."""
    return not all(is_overlay(entry) for entry in ranked)


def is_overlay(entry: Ranked) -> bool:
    """Whether the structure is a lattice as fine as the hexes."""
    return _family(entry) in (OVERLAY, SPARE)


def spares_of(ranked: Sequence[Ranked]) -> list[int]:
    """Numbers of the structures of another genus than the part's; they rank last."""
    return [i for i, entry in enumerate(ranked) if _family(entry) == SPARE]


def _family(entry: Ranked) -> str:
    return entry.candidate.family
