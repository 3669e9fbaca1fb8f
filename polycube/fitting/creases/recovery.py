"""Recover creases released during polishing, without loss of the relevant scaled Jacobian.

Each round snaps vertices to the creases if no hex falls below a limit. The other vertices stay on
the surface and are pulled towards their crease while the worst hexes are improved. The limit is the
scaled Jacobian of the worst hex, or the value up to which the score counts it in full.
"""

import logging

import numpy as np

from polycube.fitting.creases.constraints import Matching
from polycube.fitting.creases.paths import find_routes, numbered
from polycube.fitting.local_polish import ON_GOAL, raise_worst
from polycube.fitting.problem import KEPT, FitProblem
from polycube.fitting.snapping import CREASES, FULL, State, cover_of, goals_of, merit_of, snap
from polycube.fitting.springs import together
from polycube.hexmesh.quality import off_creases
from polycube.surface.fit_target import Target
from polycube.types import HexMesh

logger = logging.getLogger(__name__)

PULL = 0.2  # weight of a crease on vertices that are not on it, per square of the size
GROW = 1.2  # factor on this weight after a round with the worst hex at the limit
WEAKEN = 0.7  # factor on this weight after a round with the worst hex more than SHORT below
SHORT = 0.01
UNTRUSTED = 0.1  # trust of vertices that did not reach their crease
BETA = 60.0  # sharpness of the soft minimum
PATIENCE = 4  # rounds without gain after which the recovery ends
GAIN = 0.0005  # smallest gain, in units of the score
SOFT = 0.0005  # of the diagonal: distance that 5 % of the creases may exceed if features are soft
ON = 0.02  # of the local edge length: distance of the vertices of such a path from its curve


def recover_creases(problem: FitProblem, matching: Matching, best: State, rounds: int) -> State:
    """The best state by merit, of the given one and those after each round.

    The given state is returned if the creases are already within 0.3 % of the diagonal (0.05 % for
    soft features), if there are no paths, and if all vertices of soft creases are on them.
    """
    off, every, soft = _off(problem, best), np.ones(len(best.x)), matching.allowed is None
    limit = SOFT if soft else CREASES
    if off <= limit or not matching.routes:
        return best
    at = goals_of(problem, best.x, matching, every)
    missed = np.linalg.norm(at.place(problem, best.x) - best.x, axis=1) > ON_GOAL
    if soft and not missed[np.append(at.curve, at.corner)].any():
        return best
    value, floor, found = _merit(problem, best, off, limit), min(best.jacobian, FULL), 0
    lengths, (cover, _) = problem.lengths(best.x, *KEPT), cover_of(problem, best, 1.0)
    x, pull, before, last = best.x, PULL, off, best.jacobian
    for k in range(rounds):
        state = _snapped_to_creases(problem, x, matching, floor)
        here = _off(problem, state)
        reached = _merit(problem, state, here, limit)
        if reached > value + GAIN:
            found = k
        if reached > value:
            best, value, off = state, reached, here
        if k - found >= PATIENCE:
            break
        margin, gain = state.jacobian - floor, state.jacobian - last
        if margin < -SHORT and gain < 0:
            pull *= WEAKEN
        elif margin > -SHORT / 5:
            pull *= GROW
        last = state.jacobian
        weight = pull * (state.trust < 1) / problem.size(state.x) ** 2
        at = goals_of(problem, state.x, matching, state.trust)
        springs = together([cover, *goals_of(problem, state.x, matching, every).springs(weight)])
        x = raise_worst(problem, state.x, lengths, at, springs, BETA)
    logger.info("polish: creases within %.2f %%, %.2f %% before", 100 * off, 100 * before)
    return best


def _snapped_to_creases(
    problem: FitProblem, x: np.ndarray, matching: Matching, floor: float
) -> State:
    """Move vertices to their creases if the hexes permit it; all others get a low trust."""
    every = np.ones(len(x))
    at = goals_of(problem, x, matching, every)
    y = snap(problem, x, at, floor, every).x
    trust = np.where(np.linalg.norm(at.place(problem, x) - y, axis=1) > ON_GOAL, UNTRUSTED, 1.0)
    return snap(problem, y, goals_of(problem, y, matching, trust), floor, trust)


def _off(problem: FitProblem, state: State) -> float:
    return off_creases(problem.target, state.x[problem.sides])


def _merit(problem: FitProblem, state: State, off: float, limit: float) -> float:
    outer = state.x[problem.outer]
    stray = np.linalg.norm(problem.target.closest(outer)[0] - outer, axis=1).max()
    return merit_of(state.jacobian, float(stray), off, limit)


def existing_paths(mesh: HexMesh, target: Target) -> dict[str, np.ndarray]:
    """Vertices on each curve whose path is on edges of the mesh, by its number in `followed`.

    Later searches for paths reuse them if they are the `paths` of the mesh.
    """
    problem, x = FitProblem(mesh, target, samples=1), target.to_unit(mesh.vertices)
    size, creases = problem.size(x), target.followed.creases
    found = find_routes(target.followed, problem, x, ON)[0] if creases else []
    return {
        str(k): path
        for k, path in numbered(found, target.followed).items()
        if (creases[k].nearest(x[path])[1] < ON * size[path]).all()
    }
