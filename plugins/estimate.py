"""Estimates: what a move of the search gains, and what it costs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import log2
from typing import TYPE_CHECKING, Any

from polycube.kinds import Estimate, Expected
from polycube.registry import register
from polycube.types import Goal, Tier

if TYPE_CHECKING:
    from polycube.search.again import Again
    from polycube.search.history import History
    from polycube.search.moves import Cure, FitPartly, MeshStructure, Propose

FEW = 1.0  # work to mesh any structure
EACH = 0.8  # work to mesh a thousand hexes
CURE = 0.2  # work to improve any mesh
EACH_CURE = 0.02  # work to improve one poor hex
EACH_FURTHER = 0.002  # work to improve one hex below the goal
# of exact, coarse, learned, fine and last structures: work to propose them, with their ranking, and
# probability that one of them is the one to mesh
PROPOSE = dict(zip(Tier, (1.0, 10.0, 8.0, 2.0, 1.0), strict=True))
SUCCESS = dict(zip(Tier, (0.9, 0.7, 0.05, 0.7, 0.3), strict=True))
LEARNED = 0.3  # the probability for learned structures of a surface without CAD faces
BESIDE = 0.2  # factor for structures without exact hexes if these have the best mesh
MANY_FEATURES = 250  # features of a part that is as likely to need a fine lattice as a coarse one
# features of a coarse polycube that fails in half of the cases: some, and more for each box
FEATURES_OF_SOME, FEATURES_OF_BOX = 100, 2
CELLS_OF_FEATURE = 25.0  # cells for each feature of a fine lattice that keeps half of them
LAYERS = 1.4  # hexes for each cell of a fine lattice, with the layers under its boundary
COARSE_HEXES = 3.0  # thousands of hexes of a coarse structure
FINE_HEXES = 10.0  # thousands of hexes of a fine lattice
FLOOR = 0.15  # shortfall that typically remains
SCORE = 9.0  # ranking score of a structure whose mesh succeeds in half of the cases
ANOTHER = 0.7  # factor on the probability for each structure of the same tier that was meshed
# share of each part of the shortfall that another variant is expected to remove
VARIANT = {"features": 0.01, "distances": 0.05, "warnings": 0.03}
VALID = {2.0: 0.3, 2.5: 0.05}  # the same for a mesh that is not valid, by its shortfall
JACOBIAN = {True: 0.1, False: 0.3}  # the same for the worst hex: of a CAD part, of another surface
OTHER_SHEETS = 0.3  # probability that other sheets in a fine lattice are better
AFTER_FAILURE = 0.4  # factor on the probability for each variant without a mesh
NEXT_VARIANT = 0.7  # factor for each further variant
CURED, WARNED = 0.8, 0.7  # shares expected to vanish: of the worst hex, of warned distances
MADE_VALID = {2.0: 0.6, 3.0: 0.1}  # the same for a mesh that is not valid, by its shortfall
AGAIN_INVALID = 0.6  # factor for each mesh that was not made valid
REPLACED = 0.8  # factor on it if the mesh lost features and may be replaced
AGAIN = 0.3  # probability that smaller hexes keep the lost features
SMALLER = 2.0  # factor on the work of a mesh with smaller hexes
FINE_ANYWAY = 0.05  # factor on the probability of a fine lattice for a part with few features
TINY = 1e-9  # gain of the last resort if there is no mesh, so that it follows all other moves
SOUND = 0.01  # gain of the last resort if the best mesh has inverted hexes or crossings


@register("estimate", "rules")
@dataclass(frozen=True)
class Rules(Estimate):
    """Fixed rules by the tier and the score of a structure, and by what its meshes missed.

    The gain is the probability of a better mesh, times the part of the shortfall that such a move
    can remove.
    """

    def __call__(self, move: Any, history: Any) -> Expected:
        """Expected gain and work of a move; nothing is expected of an unknown move."""
        for cls in type(move).__mro__:
            if cls.__name__ in RULES:
                return RULES[cls.__name__](move, history)
        return Expected(0.0, FEW)


def propose(move: Propose, history: History) -> Expected:
    """Structures of a tier, and the mesh of the best of them."""
    success, hexes = SUCCESS[move.tier], COARSE_HEXES
    many = _features(history) / MANY_FEATURES
    if not many and move.tier == Tier.LEARNED:
        success = LEARNED
    if move.tier in (Tier.COARSE, Tier.LEARNED):
        success /= 1 + many**2
    if move.tier == Tier.FINE:
        success, hexes = success * max(many, FINE_ANYWAY) / (1 + many), FINE_HEXES
    success *= _beside(history, move.tier)
    exact = [n for n, each in enumerate(history.ranked) if each.candidate.tier == Tier.EXACT]
    if not all(history.of_structure(number) for number in exact):
        success *= 1 - SUCCESS[Tier.EXACT]  # it is needed only if that fails
    return Expected(success * _left(history, hexes), PROPOSE[move.tier] + FEW + EACH * hexes)


def mesh_structure(move: MeshStructure, history: History) -> Expected:
    """A variant of a structure: less likely to be better after each mesh of the same kind."""
    if not history.ranked:
        return Expected(history.shortfall, FEW)
    meshed = history.of_structure(move.structure)
    thousands = _thousands(history, move.structure)
    work = FEW + EACH * thousands
    if not (move.variant and meshed):
        success = _success(history, move.structure) * AFTER_FAILURE**move.variant
        return Expected(success * _left(history, thousands), work)
    if any(each.verdict.shortfall.get("validity", 0.0) > max(VALID) for each in meshed):
        return Expected(0.0, work)  # inverted hexes or crossings
    best = min(meshed, key=lambda each: each.shortfall)
    shares = {**VARIANT, "scaled_jacobian": JACOBIAN[len(best.state.surface.region) > 0]}
    shares["validity"] = VALID.get(best.verdict.shortfall.get("validity", 0.0), 0.0)
    gain = sum(shares.get(name, 0) * value for name, value in best.verdict.shortfall.items())
    behind = best.shortfall - history.shortfall
    gain = gain * NEXT_VARIANT ** (move.variant - 1) - behind
    if history.ranked[move.structure].candidate.tier >= Tier.FINE:  # improved as the mesh before
        poor = best.verdict.shortfall.get("scaled_jacobian", 0.0)
        gain = max(gain, OTHER_SHEETS * (CURED * poor - behind))
    return Expected(max(0.0, gain), work)


def cure(move: Cure, history: History) -> Expected:
    """Local improvement: the worst hex becomes good in most cases; only worth it in the lead."""
    from polycube.hexmesh.scaled_jacobian import scaled_jacobian

    outcome = history.outcomes[move.of]
    mesh, missed = outcome.state.hexes, outcome.verdict.shortfall
    assert mesh is not None
    jacobian = scaled_jacobian(mesh.vertices, mesh.hexes)
    poor = (jacobian < Goal.weak_jacobian).sum()
    further = (jacobian < Goal.scaled_jacobian).sum()
    invalid = missed.get("validity", 0.0)
    alike = [each for each in history.outcomes if type(each.move) is type(move)]
    failed = sum(not each.verdict.is_valid for each in alike)
    gain = invalid + CURED * missed.get("scaled_jacobian", 0.0)
    if "scaled_jacobian" in missed:  # only the neighbourhoods of poor hexes are fitted again
        gain += WARNED * missed.get("warnings", 0.0)
    behind = outcome.shortfall - history.shortfall  # 0 for the leading mesh
    success = MADE_VALID.get(invalid, 0.0) * AGAIN_INVALID**failed if invalid else 1.0
    success *= REPLACED if "features" in missed else 1
    work = CURE + EACH_CURE * float(poor) + EACH_FURTHER * float(further)
    return Expected(success * max(0.0, gain - behind), work)


def again(move: Again, history: History) -> Expected:
    """Smaller hexes, for what the leading mesh missed."""
    outcome = history.outcomes[move.of]
    thousands = len(outcome.state.hexes.hexes) / 1000 if outcome.state.hexes else COARSE_HEXES
    gain = AGAIN * outcome.verdict.shortfall.get(move.misses, 0.0)
    return Expected(gain, SMALLER * (FEW + EACH * thousands))


def fit_partly(move: FitPartly, history: History) -> Expected:
    """The last resort: other moves from which something is expected come first."""
    return Expected(TINY if history.leader is None else SOUND, FEW)


def _success(history: History, structure: int) -> float:
    """Probability that the first mesh of a structure is good."""
    candidate, score = history.ranked[structure].candidate, history.ranked[structure].score
    tried = {each.state.chosen for each in history.outcomes}
    same = sum(history.ranked[number].candidate.tier == candidate.tier for number in tried)
    success = SUCCESS[candidate.tier] * ANOTHER**same * _beside(history, candidate.tier)
    features = _features(history)
    boxes = int(candidate.polycube.occupancy.sum())
    if candidate.tier >= Tier.FINE:
        return success * boxes / (boxes + CELLS_OF_FEATURE * features)
    if candidate.blocks is None:
        success /= 1 + (features / (FEATURES_OF_SOME + FEATURES_OF_BOX * boxes)) ** 2
    return success / (1 + (score / SCORE) ** 2) if candidate.tier > Tier.EXACT else success


def _beside(history: History, tier: Tier) -> float:
    """Factor on the probability of a structure of a tier if the best mesh has exact hexes.

    If it lost features, few boxes may keep them.
    """
    leader = history.leader
    if leader is None or not history.ranked or tier == Tier.EXACT:
        return 1.0
    is_exact = history.ranked[leader.state.chosen].candidate.tier == Tier.EXACT
    may_keep = tier < Tier.FINE and "features" in leader.verdict.shortfall
    return BESIDE if is_exact and not may_keep else 1.0


def _left(history: History, thousands: float) -> float:
    """Shortfall that a good mesh with so many hexes would remove."""
    many = log2(max(1.0, 1000 * thousands / Goal.hexes))
    return max(0.0, history.shortfall - FLOOR - Goal.many * many)


def _thousands(history: History, structure: int) -> float:
    """Expected number of hexes of a structure, in thousands."""
    candidate, meshed = history.ranked[structure].candidate, history.of_structure(structure)
    if meshed and meshed[0].state.hexes is not None:
        return len(meshed[0].state.hexes.hexes) / 1000
    if candidate.blocks is not None:
        return max(COARSE_HEXES, len(candidate.blocks.hexes) / 1000)
    cells = int(candidate.polycube.occupancy.sum()) / 1000
    return LAYERS * cells if candidate.tier >= Tier.FINE else max(COARSE_HEXES, 8 * cells)


def _features(history: History) -> int:
    """Number of points, curves and faces of a CAD part; 0 for other surfaces."""
    from polycube.hexmesh.feature_distances import points_of
    from polycube.surface.fit_target import target

    found = target(history.task.start.surface).features
    return found.n_faces and found.n_faces + len(found.creases) + len(points_of(found))


RULES: dict[str, Callable[[Any, Any], Expected]] = {
    "Propose": propose,
    "MeshStructure": mesh_structure,
    "Cure": cure,
    "Again": again,
    "FitPartly": fit_partly,
}
