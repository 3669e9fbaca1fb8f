"""Improve the worst scaled Jacobian with the boundary on the surface.

Soft rounds minimise sum exp(-beta (SJ - offset)) / beta with increasing beta, with springs at the
boundary. Hard rounds use stiff springs, so that vertices slide in tangent planes and along sharp
edges. Local rounds move only vertices close to the worst hexes. Finally, released creases are
recovered. Every round projects the boundary onto the surface, less far if a hex would suffer, and
the best mesh is returned.
"""

import logging
from copy import copy
from dataclasses import replace
from functools import lru_cache

import numpy as np

from polycube.fitting.creases.constraints import (
    Matching,
    match,
    no_features,
    on_curved,
    with_tolerances,
)
from polycube.fitting.creases.recovery import recover_creases
from polycube.fitting.energy import Terms
from polycube.fitting.local_polish import raise_worst
from polycube.fitting.problem import KEPT, FitProblem
from polycube.fitting.snapping import GOOD, POINT_ALPHA, State, cover_of, goals_of, snap, state_of
from polycube.fitting.springs import adjusted, between, pull
from polycube.fitting.untangling import untangled
from polycube.surface.fit_target import ALPHA, Target
from polycube.types import HexMesh

logger = logging.getLogger(__name__)

# scaled Jacobians below which soft features are released, one for each pass
RELEASE_BELOW = 0.35, 0.45, 0.55
INVERTING = (0.02,)  # the same for exact features: only nearly inverted hexes
SOFT = Terms(shape=0.05, barrel=0.05, jacobian=1.0)  # energy of the soft rounds
SOFT_BETAS = 5.0, 25.0  # sharpness of the soft minimum in the first and the last soft round
SOFT_WEIGHTS = 10.0, 300.0  # weight of the boundary in the first soft round, and later
EARLY = 1.5  # the last weight is reached so many times earlier than the last round
SLACK = 0.01  # share of this weight along the surface
WEAKEST = 0.05  # smallest weight beside released hexes
POINTS, MOST_POINTS = 0.2, 30.0  # share of the weight for points of the surface, up to this value
SOFT_OFFSETS, HARD_OFFSETS = (-0.2, 0.5), (-0.2, 0.6)  # limits of the offset
UNTRUSTED, START = 0.2, 0.1  # features beside hexes below the first value start with this trust
LIFTED = 0.15  # scaled Jacobian below which the boundary is released in soft rounds
RELEASE, RECOVER, HOLD = 0.3, 1.3, 1.5  # factors: on both at poor hexes, on trust, on the boundary
HARD = Terms(shape=0.02, barrel=0.05, jacobian=1.0)  # energy of the hard rounds
HARD_BETAS = 8.0, 60.0  # sharpness in the first and the last hard round
STIFF, LOOSE = 3000.0, 0.02  # weights of the boundary then, normal to it and along it
STRAY = 0.02  # distance, in local sizes, at which the normal weight is half
LOSS = 0.02  # loss of score that a projection may cause, down to LEAST, and always above ENOUGH
LEAST, ENOUGH = 0.02, 0.6
RESTART = 0.15  # loss of score after which a hard round begins at the best mesh
PATIENCE = 8  # rounds without improvement after which a phase ends
BETAS = 20.0, 250.0  # sharpness of the soft minimum in the first and the last local round
SHARPEN = 1.6  # factor after a local round of small gain
SMALL_GAIN = 0.004  # gain of a local round that counts as small
LOCAL_RESTART = 0.05  # the same for a local round
MORE, LESS = 1.2, 0.7  # ratio to it at which springs are doubled; factor on them otherwise
MISSED = 0.008  # distance exceeded by 1 % of the surface that has no penalty
# scaled Jacobian equivalent to a diagonal of distance beyond MISSED, or beyond the initial value
UNCOVERED = 10.0


def polish(
    mesh: HexMesh,
    target: Target,
    *,
    features: bool = True,
    exact: bool = False,
    hold: bool = False,
    free_below: float = 0.0,
    soft_rounds: int = 8,
    hard_rounds: int = 4,
    local_rounds: int = 40,
    crease_rounds: int = 12,
    samples: int = 2500,
) -> HexMesh:
    """The best mesh found, in model units; its score is never worse than that of the given one.

    features : also move vertices onto the curves of the surface
    exact : features are not released
    hold : vertices on curved creases and curved CAD faces do not slide, and no crease is recovered
    free_below : scaled Jacobian of hexes beside which held vertices slide after all, at the end
    soft_rounds, hard_rounds, local_rounds : largest numbers of rounds of matching and descent
    crease_rounds : largest number of rounds that recover creases
    samples : points of the surface that are matched with the mesh
    """
    initial, matching, best = _after_soft_and_hard(
        mesh, target, features, exact, hold, (soft_rounds, hard_rounds), samples
    )
    problem = copy(initial)  # the matches of the last search belong to the copy
    moves = ~on_curved(problem, matching) if hold else None
    best = _local(problem, matching, best, local_rounds, moves)
    if moves is not None and best.jacobian < free_below:
        moves |= problem.touching(problem.scaled_jacobian(best.x) < free_below)
        best = _local(problem, matching, best, local_rounds, moves)
    if not hold:
        best = recover_creases(problem, matching, best, crease_rounds)
    form = "polish: smallest scaled Jacobian %.3f, boundary within %.3f %% of the diagonal"
    logger.info(form, best.jacobian, 100 * best.residual)
    return replace(mesh, vertices=target.to_model(best.x))


@lru_cache(maxsize=4)  # the short and the full run of a search share these rounds
def _after_soft_and_hard(
    mesh: HexMesh,
    target: Target,
    features: bool,
    exact: bool,
    hold: bool,
    rounds: tuple[int, int],
    samples: int,
) -> tuple[FitProblem, Matching, State]:
    """Best state after the soft and the hard rounds, with its matching."""
    problem = FitProblem(mesh, target, samples)
    x = untangled(problem, target.to_unit(mesh.vertices))
    matching = match(problem, x) if features else no_features()
    if exact:
        matching = with_tolerances(matching, len(x))
    best = state_of(problem, x, goals_of(problem, x, matching, np.ones(len(x))), np.ones(len(x)))
    moves = ~on_curved(problem, matching) if hold else None
    passes = INVERTING if exact else RELEASE_BELOW
    for least in passes if matching.routes else passes[:1]:
        best = _soft(problem, x, matching, best, rounds[0], least, moves)
        best = _hard(problem, matching, best, rounds[1], moves)
        if best.score > GOOD:
            break
        x = best.x
    return problem, matching, best


def _soft(
    problem: FitProblem,
    x: np.ndarray,
    matching: Matching,
    best: State,
    rounds: int,
    release_below: float,
    moves: np.ndarray | None,
) -> State:
    """Best projected state of rounds with springs at the boundary, weak below `release_below`."""
    jacobian = problem.scaled_jacobian(x)
    trust = np.where(problem.touching(jacobian < min(UNTRUSTED, release_below)), START, 1.0)
    hold = np.ones(len(x))
    found = rounds // 3  # round of the best state
    for k, step in enumerate(np.linspace(0, 1, rounds)):
        weight = between(SOFT_WEIGHTS, min(1.0, EARLY * step))
        at = goals_of(problem, x, matching, np.ones(len(x)))
        size = problem.size(x)
        on = (np.maximum(weight * hold, WEAKEST) / size**2)[problem.outer]
        _, quad_normals = problem.normals(x)
        points = POINTS * min(weight, MOST_POINTS)
        springs = [
            pull(problem.outer, at.foot, at.facing, on, SLACK * on),
            *at.springs(weight * trust / size**2),
            problem.cover(x, quad_normals, ALPHA, points * trust, 0.0),
        ]
        offset = float(np.clip(jacobian.min(), *SOFT_OFFSETS))
        terms = SOFT._replace(beta=between(SOFT_BETAS, step), offset=offset)
        x = problem.relax(x, problem.lengths(x, *KEPT), terms, springs, 20, moves)
        jacobian = problem.scaled_jacobian(x)
        trust = adjusted(trust, problem.touching(jacobian < release_below), RELEASE, 0.0, RECOVER)
        hold = adjusted(hold, problem.touching(jacobian < LIFTED), RELEASE, 0.0, HOLD)
        if k >= rounds // 3:
            at = goals_of(problem, x, matching, trust)
            new = snap(problem, x, at, min(release_below, jacobian.min()), trust)
            if new.score > best.score:
                best, found = new, k
            elif k - found > PATIENCE:
                break
    return best


def _hard(
    problem: FitProblem, matching: Matching, best: State, rounds: int, moves: np.ndarray | None
) -> State:
    """Best projected state of rounds with stiff springs, starting from the given one."""
    x, trust = best.x, best.trust
    found = 0  # round of the best state
    for k, step in enumerate(np.linspace(0, 1, rounds)):
        at = goals_of(problem, x, matching, trust)
        size = problem.size(x)
        free = ~np.isin(problem.outer, np.append(at.curve, at.corner))
        vertex, foot = problem.outer[free], at.foot[free]
        stray = np.linalg.norm(foot - x[vertex], axis=1) / size[vertex]
        on = STIFF / (1 + (stray / STRAY) ** 2) / size[vertex] ** 2
        _, quad_normals = problem.normals(x)
        springs = [
            pull(vertex, foot, at.facing[free], on, on * (LOOSE / STIFF)),
            *at.springs(STIFF / size**2),
            problem.cover(x, quad_normals, POINT_ALPHA, 1.0 * trust, 0.0),
        ]
        offset = float(np.clip(problem.scaled_jacobian(x).min(), *HARD_OFFSETS))
        terms = HARD._replace(beta=between(HARD_BETAS, step), offset=offset)
        x = problem.relax(x, problem.lengths(x, *KEPT), terms, springs, 25, moves)
        least = max(min(best.score - LOSS, ENOUGH), LEAST)
        new = snap(problem, x, goals_of(problem, x, matching, trust), least, trust)
        if new.score > best.score:
            best, found = new, k
        elif k - found > PATIENCE:
            break
        x = new.x if new.score > best.score - RESTART else best.x
    return best


def _local(
    problem: FitProblem, matching: Matching, best: State, rounds: int, moves: np.ndarray | None
) -> State:
    """Best state of rounds close to the worst hexes; the minimum is sharpened at small gain.

    The springs of the surface are doubled after a round that leaves it uncovered.
    """
    x, trust, beta, strength = best.x, best.trust, BETAS[0], 1.0
    lengths = problem.lengths(x, *KEPT)
    cover, missed = cover_of(problem, best, strength)
    allowed, value = max(missed, MISSED), best.score
    for _ in range(rounds):
        x = raise_worst(
            problem, x, lengths, goals_of(problem, x, matching, trust), cover, beta, moves
        )
        at = goals_of(problem, x, matching, trust)
        least = max(best.score - LOSS, LEAST)
        states = state_of(problem, x, at, trust), snap(problem, x, at, least, trust)
        new = max(states, key=lambda state: state.score)
        cover, missed = cover_of(problem, new, strength)
        strength = 2 * strength if missed > MORE * allowed else max(1.0, LESS * strength)
        reached = new.score - UNCOVERED * max(0.0, missed - allowed)
        if reached < value + SMALL_GAIN:
            beta *= SHARPEN
        if reached > value:
            best, value = new, reached
        if beta > BETAS[1]:
            break
        x = new.x
        if reached < value - LOCAL_RESTART:
            x, (cover, _) = best.x, cover_of(problem, best, strength)
    return best
