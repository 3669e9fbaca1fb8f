"""Improve the worst hexes by moving only the vertices close to them.

The vertices minimise a sharp soft minimum of the scaled Jacobian. Those on the boundary slide:
every step of the search is projected onto the surface, so that no later projection loses the gain.
(With only the tangent planes as constraint, the gain was lost at the creases of a coarse surface.)
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from polycube.fitting import energy
from polycube.fitting.creases.constraints import Goals
from polycube.fitting.energy import Terms
from polycube.fitting.problem import FitProblem
from polycube.fitting.springs import Springs, pull, together
from polycube.numerics.lbfgs import descend
from polycube.surface.fit_target import ALPHA, FREE

BAND = 0.1  # hexes better than the worst one by up to this value are improved as well
MOST = 60  # largest number of these hexes
RINGS = 1  # rings of hexes around them whose vertices move; 2 and 3 cost more without gain
ITERATIONS = 30
ON_GOAL = 1e-6  # distance from a goal, in diagonals, below which a vertex is at its goal
LOOSE = 3.0  # weight of the springs of other vertices, per square of the size
SLIDING = Terms(shape=0.01, barrel=0.05, jacobian=1.0)  # of vertices that slide on the surface

Function = Callable[..., tuple[float, np.ndarray]]  # positions (and springs): value and gradient


@dataclass(frozen=True, eq=False)
class Region:
    """The part of a mesh around moving vertices: all hexes that contain one."""

    hexes: np.ndarray  # (h,) hexes of the mesh
    vertices: np.ndarray  # (v,) vertices of the mesh
    corners: np.ndarray  # (h, 8) indices of `vertices`
    moves: np.ndarray  # (v,) bool


def region(hexes: np.ndarray, n_vertices: int, seeds: np.ndarray, rings: int) -> Region:
    """The vertices of the seeds (hexes) and of some rings of hexes around them move."""
    moves = np.zeros(n_vertices, bool)
    moves[hexes[seeds]] = True
    for _ in range(rings):
        moves[hexes[moves[hexes].any(axis=1)]] = True
    near = np.flatnonzero(moves[hexes].any(axis=1))
    vertices, corners = np.unique(hexes[near], return_inverse=True)
    return Region(near, vertices, corners.reshape(-1, 8), moves[vertices])


def raise_worst(
    problem: FitProblem,
    x: np.ndarray,
    lengths: np.ndarray,
    at: Goals,
    cover: Springs,
    beta: float,
    moves: np.ndarray | None = None,
) -> np.ndarray:
    """Positions (V, 3) with a higher soft minimum close to the worst hexes.

    lengths : (H, 3) wanted lengths
    at : goals of x; vertices at their goals stay on the surface
    cover : springs from the target to all boundary quads
    beta : sharpness of the minimum
    moves : (V,) vertices that may move; None: all
    """
    jacobian = problem.scaled_jacobian(x)
    seeds = np.argsort(jacobian, kind="stable")[:MOST]
    seeds = seeds[jacobian[seeds] < jacobian.min() + BAND]
    part = region(problem.hexes, len(x), seeds, RINGS)
    if moves is not None:
        part = replace(part, moves=part.moves & moves[part.vertices])
    start = np.ascontiguousarray(x[part.vertices])
    lengths = np.ascontiguousarray(lengths[part.hexes])
    floor = energy.bound(energy.least_determinant(start, part.corners, lengths))
    terms = SLIDING._replace(beta=beta, offset=float(jacobian.min()), floor=floor)
    whole = partial(energy.energy, hexes=part.corners, lengths=lengths, terms=terms)
    result = x.copy()
    near = _within(cover, part, len(x))
    result[part.vertices] = slid(problem, x, at, part, whole, [near], ITERATIONS)
    return result


def slid(
    problem: FitProblem,
    x: np.ndarray,
    at: Goals,
    part: Region,
    whole: Function,
    springs: list[Springs],
    iterations: int,
) -> np.ndarray:
    """Positions (v, 3) of a region with a lower energy; its boundary slides on the surface.

    at : goals of x; vertices that are not at their goals have springs to them and do not slide
    whole : energy of positions and springs
    springs : further springs
    """
    goal = at.place(problem, x)
    is_away = np.linalg.norm(goal - x, axis=1) > ON_GOAL
    here = np.flatnonzero(is_away[part.vertices] & part.moves)
    vertex = part.vertices[here]
    every = LOOSE / problem.size(x)[vertex] ** 2
    back = pull(here, goal[vertex], np.zeros((len(here), 3)), 0 * every, every)
    pulls = together([back, *springs])
    rails, slides = _rails(problem, at, part, is_away)
    sliding = part.vertices[slides]
    normals, face = problem.normals(x)[0][sliding], np.zeros(len(sliding), np.int64)
    cad_face = problem.vertex_face[np.searchsorted(problem.outer, sliding)]

    def function(y: np.ndarray) -> tuple[float, np.ndarray]:
        value, gradient = whole(y, springs=pulls)
        return value, np.einsum("vij,vj->vi", rails, gradient)

    def retract(y: np.ndarray) -> np.ndarray:
        nonlocal face
        y[slides], face = problem.target.closest(y[slides], normals, ALPHA, face, FREE, cad_face)
        return y

    return descend(function, x[part.vertices], iterations, retract=retract)


def _within(cover: Springs, part: Region, n_vertices: int) -> Springs:
    """The springs that involve moving vertices and no vertex outside the region."""
    local = np.full(n_vertices, -1)
    local[part.vertices] = np.arange(len(part.vertices))
    index = local[cover.vertex]  # (S, 4)
    pulls = (cover.along != 0) | (cover.every != 0)
    is_inside = (index >= 0).all(axis=1) & part.moves[index].any(axis=1) & pulls
    return Springs(*(values[is_inside] for values in cover))._replace(vertex=index[is_inside])


def _rails(
    problem: FitProblem, at: Goals, part: Region, is_away: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Projectors (v, 3, 3) onto the permitted directions, and (v,) which slide on the surface."""
    rails = np.tile(np.eye(3), (len(is_away), 1, 1))
    rails[problem.outer] -= at.facing[:, :, None] * at.facing[:, None]
    rails[at.curve] = at.direction[:, :, None] * at.direction[:, None]
    rails[at.corner] = 0
    rails[is_away] = np.eye(3)
    slides = np.zeros(len(is_away), bool)
    slides[problem.outer] = True
    slides[at.curve] = slides[at.corner] = slides[is_away] = False
    rails, slides = rails[part.vertices], slides[part.vertices] & part.moves
    rails[~part.moves] = 0
    return rails, slides
