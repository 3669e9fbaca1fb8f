"""A mesh with every hex in eight whose finer boundary follows the surface.

The boundary goes to its feet with the inside following harmonically, so that thin layers move as
one.  Gentle rounds of shape, scaled Jacobian and springs to surface and sharp edges spread what is
left, and hard rounds of `polish` raise the worst hex.  After every move the few neighbourhoods
whose hexes would suffer go only part of the way: quality is kept, and the surface given up there.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import cg

from polycube.fitting.creases.constraints import Goals, Matching, goals, match, no_features
from polycube.fitting.energy import Terms
from polycube.fitting.merit import least_jacobian, merit, misses
from polycube.fitting.polish import polish
from polycube.fitting.problem import FitProblem
from polycube.fitting.springs import pull
from polycube.hexmesh.connectivity import edges
from polycube.hexmesh.inspection import Inspection, inspect
from polycube.hexmesh.octree import split
from polycube.surface.fit_target import Target, target
from polycube.types import HexMesh, TriMesh

logger = logging.getLogger(__name__)

GOOD = 0.5  # score that needs no other recipe
REACH = 0.0038  # distance that 99 % of the surface should be within: 0.4 % by any sampling
FAR = 50.0  # what the score loses per diagonal beyond it
NORMALS = 0.04  # length that a whole turn of the normal is worth, in diagonals
NEAR = 0.3  # distance of a sharp edge that the boundary is sent to, in local sizes
ATTEMPTS = 40  # to go less far; in the last ten nothing moves round a bad hex
SAMPLES = 3  # points of the surface that look for the mesh, per boundary vertex


@dataclass(frozen=True)
class Recipe:
    """How the finer boundary is brought to the surface after its first move."""

    name: str
    rounds: int  # of the gentle fit
    weight: tuple[float, float]  # of its springs, in the first round and in the last
    cover: float  # weight of the pull from the surface's side, a share of these
    features: bool = True  # sharp polycube edges follow sharp edges of the surface


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
    """The mesh with every hex in eight, or the same mesh where none keeps its quality.

    It must come nearer to the surface, or be within the reach, with a scaled Jacobian of at least
    0.41 (or 0.9 of the mesh's own where that is less), miss no more limits and lose no more
    features of a CAD part.  A second recipe is tried where the first is not good or misses the
    reach; the best of those within it is kept.

    features : also keep sharp polycube edges on sharp edges of the surface
    reach : distance that 99 % of the surface should be within, in diagonals
    exact : the features do not give way
    """
    before = inspect(mesh, surface)
    least = least_jacobian(before.scaled_jacobian)
    best, fine = None, split(mesh)
    for recipe in RECIPES[:1] if exact else RECIPES:
        for way, tried in _tries(fine, target(surface), recipe, features, least, exact):
            found = inspect(tried, surface)
            apart, value = found.deviation.to_mesh.p99, merit(found)
            logger.info(
                "refine, %s: smallest scaled Jacobian %.3f, 99 %% of the surface within %.2f %%, "
                "vertices within %.2f %%",
                way,
                found.scaled_jacobian,
                100 * apart,
                100 * found.deviation.vertices,
            )
            is_near = apart <= reach or apart + 1e-9 < before.deviation.to_mesh.p99
            passes = found.scaled_jacobian >= least and is_near
            sound = misses(found) <= misses(before) and _lost(found) <= _lost(before)
            worth = apart <= reach, value - FAR * max(0.0, apart - reach)
            if passes and sound and (best is None or worth > best[0]):
                best = worth, tried
        if best is not None and best[0] >= (True, GOOD):
            break
    if best is None:
        logger.info("refine: no finer mesh has a scaled Jacobian of %.2f or more", least)
        return mesh
    return best[1]


def _lost(found: Inspection) -> int:
    """Features of a CAD part that the mesh loses."""
    return sum(feature.is_lost for feature in found.features)


def _tries(
    fine: HexMesh, goal: Target, recipe: Recipe, features: bool, least: float, exact: bool
) -> Iterator[tuple[str, HexMesh]]:
    """Meshes by a recipe: as it is fitted, then with its worst hex raised."""
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
    x = advance(
        problem, x, goal.to_unit(raised.vertices), least
    )  # it may give quality for closeness
    yield f"{recipe.name}, raised", replace(fine, vertices=goal.to_model(x))


def advance(problem: FitProblem, x: np.ndarray, wanted: np.ndarray, least: float) -> np.ndarray:
    """Positions (V, 3) from x towards those wanted, less far round hexes that would fall too low.

    No hex falls below `least`, and none that is below it already gets worse: where all of a
    neighbourhood stays, it is as it was.
    """
    allowed = np.minimum(least, problem.scaled_jacobian(x) - 1e-6)
    share = np.ones(len(x))
    for attempt in range(ATTEMPTS):
        y = x + share[:, None] * (wanted - x)
        bad = problem.scaled_jacobian(y) < allowed
        if not bad.any():
            return y
        rings = _rings(problem, problem.touching(bad))
        share *= 1 - 0.3 * rings if attempt < ATTEMPTS - 10 else rings < 1
    return x


def _rings(problem: FitProblem, near: np.ndarray) -> np.ndarray:
    """(V,) 1 at the vertices marked, 0 from the fourth ring of hexes round them on."""
    level = near.astype(float)
    for ring in range(1, 4):
        near = problem.touching(near[problem.hexes].any(axis=1))
        level = np.maximum(level, near * (1 - ring / 4))
    return level


def _at_goals(problem: FitProblem, x: np.ndarray, matching: Matching) -> np.ndarray:
    """Positions with the whole boundary at its goals and the inside carried along."""
    return x + harmonic(problem, x, _near_goals(problem, x, matching).place(problem, x) - x)


def _near_goals(problem: FitProblem, x: np.ndarray, matching: Matching) -> Goals:
    """Goals of the boundary vertices; sharp edges and corners only where they are near."""
    at = goals(problem, x, matching, NORMALS, np.ones(len(x), bool))
    gap = np.linalg.norm(at.place(problem, x) - x, axis=1)
    return goals(problem, x, matching, NORMALS, gap < NEAR * problem.size(x))


def harmonic(problem: FitProblem, x: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """(V, 3) displacement that is `shift` on the boundary and harmonic inside.

    Edges conduct by their inverse length: the two ends of a short one move alike.
    """
    ends = edges(problem.hexes)
    length = np.linalg.norm(x[ends[:, 0]] - x[ends[:, 1]], axis=1)
    conducts = np.tile(1 / np.maximum(length, 1e-3 * length.mean()), 2)
    pairs = np.append(ends[:, 0], ends[:, 1]), np.append(ends[:, 1], ends[:, 0])
    graph = coo_matrix((conducts, pairs), (len(x), len(x))).tocsr()
    total = np.asarray(graph.sum(axis=1)).ravel()
    free = np.setdiff1d(np.arange(len(x)), problem.outer)
    moved = np.zeros_like(x)
    moved[problem.outer] = shift[problem.outer]
    matrix, right = diags(total[free]) - graph[free][:, free], graph[free] @ moved
    for d in range(3):
        moved[free, d] = cg(matrix, right[:, d], rtol=1e-4, maxiter=500, M=diags(1 / total[free]))[
            0
        ]
    return moved


def _fit(problem: FitProblem, x: np.ndarray, matching: Matching, recipe: Recipe) -> np.ndarray:
    """Rounds of descent with springs that grow stiff; weaker ones round bad hexes."""
    trust = np.ones(len(x))
    low, high = recipe.weight
    for step in np.linspace(0, 1, recipe.rounds):
        weight = low * (high / low) ** step
        at = goals(problem, x, matching, NORMALS, trust > 0.3)
        size, (_, quad_normals) = problem.size(x), problem.normals(x)
        on = (weight * trust / size**2)[problem.outer]
        springs = [
            pull(problem.outer, at.foot, at.facing, on, 0.02 * on),
            *at.springs(weight * trust / size**2),
            problem.cover(x, quad_normals, NORMALS, recipe.cover * weight * trust, 0.0),
        ]
        terms = Terms(jacobian=1.0, beta=10.0, offset=0.5)
        x = problem.relax(x, problem.lengths(x, 3, 0.1), terms, springs, 20)
        bad = problem.touching(problem.scaled_jacobian(x) < 0.45)
        trust = np.where(bad, np.maximum(0.4 * trust, 0.02), np.minimum(1.3 * trust, 1))
    return x
