"""Mesh solids that touch as one part, with quads on their common faces.

The surfaces of all solids together are those of a part with several pieces, whose curves include
those of the common faces. A structure with exact features (sweep, turned, bent) therefore has the
common faces between its hexes; each hex belongs to the solid in which its centre is. Then vertices
move to the surfaces of their solids; those on several surfaces, to that of the first.
"""

from collections.abc import Callable, Iterable, Sequence
from itertools import accumulate

import numpy as np

from polycube.errors import MeshingError
from polycube.fitting.creases.constraints import NEAR, Goals, goals, match
from polycube.fitting.polish import HARD, HARD_BETAS, HARD_OFFSETS, LOOSE, STIFF
from polycube.fitting.problem import KEPT, FitProblem
from polycube.fitting.springs import Springs, between, pull
from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.inspection import inspect
from polycube.surface.fit_target import target
from polycube.surface.voxels import winding_numbers
from polycube.types import Candidate, Goal, HexMesh, TriMesh

Structure = Callable[[TriMesh, tuple[Candidate, ...]], Sequence[Candidate]]  # see `polycube.kinds`

ROUNDS = 10  # of fitting to the surfaces
ITERATIONS = 30  # in each round
INSIDE = 0.5  # smallest winding number at the centre of a hex


def joint_meshes(surfaces: Sequence[TriMesh], structures: Iterable[Structure]) -> list[HexMesh]:
    """The mesh of each solid, with the same vertices and quads on common faces.

    Raises MeshingError if there are none, or if hexes do not have the shape of their solid.

    surfaces : of each solid, with common triangles where they touch
    structures : are tried until one gives hexes for all solids
    """
    whole = _whole(surfaces)
    found = (c.blocks for each in structures for c in each(whole, ()) if c.blocks is not None)
    if (blocks := next(found, None)) is None:
        raise MeshingError("they are not a sweep or a turned part together")
    middle = blocks.vertices[blocks.hexes].mean(axis=1)
    inside = np.array([winding_numbers(each, middle) for each in surfaces])
    cells = inside.argmax(axis=0) == np.arange(len(surfaces))[:, None]
    if inside.max(axis=0).min() < INSIDE or not cells.any(axis=1).all():
        raise MeshingError("the hexes are not inside the solids")
    pieces = [hex_mesh(blocks.vertices, blocks.hexes[own]) for own in cells]
    vertices = _fitted(blocks, pieces, surfaces)
    meshes = []
    for piece, surface in zip(pieces, surfaces, strict=True):
        used, hexes = np.unique(piece.hexes, return_inverse=True)
        meshes.append(hex_mesh(vertices[used], hexes.reshape(-1, 8)))
        quality = inspect(meshes[-1], surface)
        worst, off = quality.scaled_jacobian, quality.deviation.vertices
        if worst < Goal.poor_jacobian or off > Goal.far_vertices:
            far = f"up to {off:.2%} of the diagonal from the surface"
            what = f"a scaled Jacobian would be {worst:.3f}, and vertices would be {far}"
            raise MeshingError(what)
    return meshes


def _whole(surfaces: Sequence[TriMesh]) -> TriMesh:
    """All surfaces as one."""
    first = [0, *accumulate(len(surface.vertices) for surface in surfaces)]
    face = [0, *accumulate(surface.region.max() for surface in surfaces)]
    return TriMesh(
        np.concatenate([s.vertices for s in surfaces]),
        np.concatenate([s.faces + n for s, n in zip(surfaces, first, strict=False)]),
        np.concatenate([s.region + n for s, n in zip(surfaces, face, strict=False)]),
        ("",) * face[-1],
    )


def _fitted(mesh: HexMesh, pieces: Sequence[HexMesh], surfaces: Sequence[TriMesh]) -> np.ndarray:
    """(V, 3) vertices of the mesh, with those on the boundary of a piece on its surface.

    The best of several rounds, each with stiff springs to the surfaces as in `polish`.
    """
    problems = [FitProblem(*each, 1) for each in zip(pieces, map(target, surfaces), strict=True)]
    goal = problems[0].target
    whole, x = FitProblem(mesh, goal, 1), goal.to_unit(mesh.vertices)
    is_free, bound = np.ones(len(x), bool), []
    for problem in problems:
        bound.append(problem.outer[is_free[problem.outer]])
        is_free[bound[-1]] = False
    matches = [match(each, each.target.to_unit(mesh.vertices)) for each in problems]
    best, found = -1.0, x
    for step in np.linspace(0, 1, ROUNDS):
        springs, place = [], x.copy()
        for problem, matching, own in zip(problems, matches, bound, strict=True):
            there = problem.target.to_unit(goal.to_model(x))
            at = goals(problem, there, matching, NEAR, ~is_free)
            place[own] = goal.to_unit(problem.target.to_model(at.place(problem, there)[own]))
            springs.append(_springs(problem, there, at, own, place[own], goal.scale))
        jacobian = float(whole.scaled_jacobian(place).min())
        if jacobian > best:
            best, found = jacobian, place
        offset = float(np.clip(whole.scaled_jacobian(x).min(), *HARD_OFFSETS))
        terms = HARD._replace(beta=between(HARD_BETAS, step), offset=offset)
        x = whole.relax(x, whole.lengths(x, *KEPT), terms, springs, ITERATIONS)
    return goal.to_model(found)


def _springs(
    problem: FitProblem, x: np.ndarray, at: Goals, own: np.ndarray, place: np.ndarray, scale: float
) -> Springs:
    """Springs from some vertices to their places (N, 3), free along faces and curves."""
    direction, along, every = np.zeros((len(x), 3)), np.zeros(len(x)), np.ones(len(x))
    direction[problem.outer], direction[at.curve] = at.facing, at.direction
    along[problem.outer], every[problem.outer] = 1, LOOSE / STIFF
    along[at.curve], every[at.curve] = -1, 1
    along[at.corner], every[at.corner] = 0, 1
    weight = STIFF / (problem.size(x)[own] * problem.target.scale / scale) ** 2
    return pull(own, place, direction[own], weight * along[own], weight * every[own])
