"""Divide every hex into eight and fit the finer boundary to the surface.

The boundary moves to its closest points and the interior follows harmonically, so that thin layers
move together. Rounds with shape energy, scaled Jacobian and springs to surface and sharp edges
distribute the deformation, and hard rounds of `polish` improve the worst hex. After each move,
regions whose hexes would suffer are moved less far, so quality has priority over distance.
"""

import logging
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from polycube.fitting.creases.constraints import Matching, goals, match, no_features
from polycube.fitting.energy import Terms
from polycube.fitting.polish import polish
from polycube.fitting.problem import RESHAPED, FitProblem
from polycube.fitting.snapping import exceeded_limits, goals_of, merit
from polycube.fitting.springs import adjusted, between, pull
from polycube.hexmesh.connectivity import edges, split
from polycube.hexmesh.inspection import inspect
from polycube.numerics.harmonic import harmonic
from polycube.surface.fit_target import ALPHA, Target, target
from polycube.types import HexMesh, TriMesh

logger = logging.getLogger(__name__)

LEAST = 0.41  # smallest scaled Jacobian of a refined mesh
# smallest share of the scaled Jacobian of the coarse mesh, if that is less than LEAST
RELATIVE_LEAST = 0.9
ROUNDING = 1e-6  # smaller differences of a scaled Jacobian or a distance do not count
GOOD = 0.5  # score above which no other recipe is tried
REACH = 0.0038  # distance within which 99 % of the surface should be: 0.4 % with any sampling
FAR = 50.0  # penalty per diagonal beyond it
NEAR = 0.3  # largest distance of a sharp edge to which the boundary is moved, in local sizes
RELEASED = 0.45  # scaled Jacobian below which the springs of a hex are weakened
SLACK = 0.02  # share of the springs along the surface
RAISING = Terms(jacobian=1.0, beta=10.0, offset=0.5)  # energy of the fit
REDUCTION = 0.3  # of the move of vertices at a bad hex, in each attempt
ATTEMPTS = 40  # attempts to move less far; in the last ten, no vertex near a bad hex moves
SAMPLES = 3  # points of the surface that are matched with the mesh, per boundary vertex


@dataclass(frozen=True)
class Recipe:
    """Parameters of the fit of the finer boundary after its first move."""

    name: str
    rounds: int  # rounds of the fit
    weight: tuple[float, float]  # weight of its springs, in the first round and in the last
    cover: float  # weight of the springs from the surface, as a share of it
    features: bool = True  # whether sharp polycube edges follow sharp edges of the surface


RECIPES = (
    Recipe("gentle", 8, (10.0, 300.0), 0.5),
    Recipe("smooth", 8, (10.0, 100.0), 0.3, features=False),
)


def refine(
    mesh: HexMesh,
    surface: TriMesh,
    features: bool = True,
    reach: float = REACH,
    exact: bool = False,
) -> HexMesh:
    """The mesh with every hex divided into eight, or the same mesh if its quality would be too low.

    The result must be closer to the surface or within the reach, with a scaled Jacobian of at least
    0.41 (or 0.9 of that of the given mesh if that is less), and it must not exceed more limits or
    lose more features of a CAD part. A second recipe is tried if the first is not good or exceeds
    the reach; the best result within the reach is returned.

    features : keep sharp polycube edges on sharp edges of the surface
    reach : distance within which 99 % of the surface should be, in diagonals
    exact : features are not released
    """
    before = inspect(mesh, surface)
    least = min(LEAST, RELATIVE_LEAST * before.scaled_jacobian)
    best, fine = None, split(mesh)
    for recipe in RECIPES[:1] if exact else RECIPES:
        for name, candidate in _candidates(fine, target(surface), recipe, features, least, exact):
            found = inspect(candidate, surface)
            distance, value = found.deviation.to_mesh.p99, merit(found)
            distances = "99 %% of the surface within %.2f %%, vertices within %.2f %%"
            form = f"refine, %s: smallest scaled Jacobian %.3f, {distances}"
            off = 100 * distance, 100 * found.deviation.vertices
            logger.info(form, name, found.scaled_jacobian, *off)
            is_near = distance <= reach or distance + ROUNDING < before.deviation.to_mesh.p99
            passes = found.scaled_jacobian >= least and is_near
            is_sound = exceeded_limits(found) <= exceeded_limits(before)
            is_sound &= found.n_lost_features <= before.n_lost_features
            rank = distance <= reach, value - FAR * max(0.0, distance - reach)
            if passes and is_sound and (best is None or rank > best[0]):
                best = rank, candidate
        if best is not None and best[0] >= (True, GOOD):
            break
    if best is None:
        logger.info("refine: no finer mesh has a scaled Jacobian of %.2f or more", least)
        return mesh
    return best[1]


def _candidates(
    fine: HexMesh, goal: Target, recipe: Recipe, features: bool, least: float, exact: bool
) -> Iterator[tuple[str, HexMesh]]:
    """Meshes by a recipe: after the fit, then with an improved worst hex."""
    use = recipe.features and features
    problem = FitProblem(fine, goal, SAMPLES * len(np.unique(fine.quads)))
    x = goal.to_unit(fine.vertices)
    matching = match(problem, x) if use else no_features()
    x = advance(problem, x, _at_goals(problem, x, matching), least)
    x = advance(problem, x, _fit(problem, x, matching, recipe), least)
    x = advance(problem, x, _at_goals(problem, x, matching), least)
    fitted = replace(fine, vertices=goal.to_model(x))
    yield recipe.name, fitted
    samples = len(problem.points)
    raised = polish(
        fitted, goal, features=use, exact=exact, soft_rounds=0, hard_rounds=10, samples=samples
    )
    # it may lose quality to get closer
    x = advance(problem, x, goal.to_unit(raised.vertices), least)
    yield f"{recipe.name}, raised", replace(fine, vertices=goal.to_model(x))


def advance(problem: FitProblem, x: np.ndarray, wanted: np.ndarray, least: float) -> np.ndarray:
    """Move x (V, 3) towards the wanted positions, less far around hexes that would become too bad.

    No hex falls below `least`, and no hex already below becomes worse: if a whole neighbourhood
    stays, it is unchanged.
    """
    allowed = np.minimum(least, problem.scaled_jacobian(x) - ROUNDING)
    share = np.ones(len(x))
    for attempt in range(ATTEMPTS):
        y = x + share[:, None] * (wanted - x)
        bad = problem.scaled_jacobian(y) < allowed
        if not bad.any():
            return y
        rings = _rings(problem, problem.touching(bad))
        share *= 1 - REDUCTION * rings if attempt < ATTEMPTS - 10 else rings < 1
    return x


def _rings(problem: FitProblem, near: np.ndarray) -> np.ndarray:
    """(V,) 1 at the marked vertices, 0 from the fourth ring of hexes around them."""
    level = near.astype(float)
    for ring in range(1, 4):
        near = problem.touching(near[problem.hexes].any(axis=1))
        level = np.maximum(level, near * (1 - ring / 4))
    return level


def _at_goals(problem: FitProblem, x: np.ndarray, matching: Matching) -> np.ndarray:
    """Positions with the whole boundary at its goals and the interior following.

    The goals are on sharp edges and corners only if these are close.
    """
    at = goals(problem, x, matching, ALPHA, np.ones(len(x), bool))
    gap = np.linalg.norm(at.place(problem, x) - x, axis=1)
    at = goals(problem, x, matching, ALPHA, gap < NEAR * problem.size(x))
    free = np.setdiff1d(np.arange(len(x)), problem.outer)
    return x + harmonic(x, edges(problem.hexes), free, at.place(problem, x) - x)


def _fit(problem: FitProblem, x: np.ndarray, matching: Matching, recipe: Recipe) -> np.ndarray:
    """Rounds of descent with increasingly stiff springs; weaker ones around bad hexes."""
    trust = np.ones(len(x))
    for step in np.linspace(0, 1, recipe.rounds):
        weight = between(recipe.weight, step)
        at = goals_of(problem, x, matching, trust)
        size, (_, quad_normals) = problem.size(x), problem.normals(x)
        on = (weight * trust / size**2)[problem.outer]
        springs = [
            pull(problem.outer, at.foot, at.facing, on, SLACK * on),
            *at.springs(weight * trust / size**2),
            problem.cover(x, quad_normals, ALPHA, recipe.cover * weight * trust, 0.0),
        ]
        x = problem.relax(x, problem.lengths(x, *RESHAPED), RAISING, springs, 20)
        trust = adjusted(trust, problem.touching(problem.scaled_jacobian(x) < RELEASED))
    return x
