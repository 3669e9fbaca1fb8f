"""Recovery of released creases without loss of the relevant scaled Jacobian."""

import numpy as np
import pytest

from polycube.fitting.creases.constraints import match, no_features, with_tolerances
from polycube.fitting.creases.recovery import recover_creases
from polycube.fitting.local_polish import raise_worst
from polycube.fitting.problem import FitProblem
from polycube.fitting.snapping import FULL, State, cover_of, goals_of, merit_of, snap
from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.quality import off_creases
from polycube.surface.fit_target import target
from polycube.types import TriMesh
from tests.fixtures.hexmeshes import unit_cubes

ROUNDS = 12


def wedge(slope: float) -> tuple[FitProblem, np.ndarray]:
    """4^3 hexes in a box with one sloped side, at unit scale; its edges are on all creases."""

    def sloped(vertices):
        return vertices * (1 + slope * vertices[:, 2:] / 4 * [1, 0, 0])

    vertices, cubes = unit_cubes(4, 4, 4)
    solid, one = unit_cubes(1, 1, 1)
    quads = hex_mesh(solid, one).quads
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    surface = target(TriMesh(sloped(4 * solid), faces))
    problem = FitProblem(hex_mesh(sloped(vertices), cubes), surface, 500)
    return problem, surface.to_unit(problem.mesh.vertices)


def state(problem: FitProblem, x: np.ndarray) -> State:
    return State(x, float(problem.scaled_jacobian(x).min()), 0.0, np.ones(len(x)))


def released(problem: FitProblem, x: np.ndarray) -> State:
    """State after improving the worst hexes on the surface without regard to creases."""
    every, free, lengths = np.ones(len(x)), no_features(), problem.lengths(x, 2, 0.05)
    for _ in range(8):
        found = snap(problem, x, goals_of(problem, x, free, every), 0.3, every)
        at = goals_of(problem, found.x, free, every)
        x = raise_worst(problem, found.x, lengths, at, cover_of(problem, found, 1.0)[0], 40.0)
    return snap(problem, x, goals_of(problem, x, free, every), 0.3, every)


def off(problem: FitProblem, found: State) -> float:
    return off_creases(problem.target, found.x[problem.sides])


def stray(problem: FitProblem, found: State) -> float:
    outer = found.x[problem.outer]
    return float(np.linalg.norm(problem.target.closest(outer)[0] - outer, axis=1).max())


def pushed(problem: FitProblem, x: np.ndarray, far: float) -> State:
    """Move the inner vertices of an edge inwards by `far`, within the top."""
    moved = x.copy()
    top = np.isclose(x[:, 2], x[:, 2].max()) & np.isclose(x[:, 0], x[:, 0].max())
    moved[top & (np.abs(x[:, 1]) < 0.9 * x[:, 1].max()), 0] -= far
    return state(problem, moved)


def test_an_edge_released_without_need_is_recovered():
    problem, x = wedge(0.5)
    start = pushed(problem, x, 0.03)
    assert off(problem, start) > 0.01
    found = recover_creases(problem, match(problem, x), start, ROUNDS)
    assert off(problem, found) < 1e-6
    assert stray(problem, found) < 1e-9
    assert found.jacobian > start.jacobian


def test_small_deviations_are_recovered_for_soft_creases_only():
    problem, x = wedge(0.5)
    start, matching = pushed(problem, x, 0.002), match(problem, x)
    assert 0.001 < off(problem, start) < 0.003
    assert off(problem, recover_creases(problem, matching, start, ROUNDS)) < 1e-6
    assert recover_creases(problem, with_tolerances(matching, len(x)), start, ROUNDS) is start


@pytest.mark.parametrize("slope", [1.0, 1.6, 2.2])
def test_recovery_does_not_reduce_the_relevant_scaled_jacobian(slope):
    problem, x = wedge(slope)
    start = released(problem, x)
    assert off(problem, start) > 0.005
    found = recover_creases(problem, match(problem, x), start, ROUNDS)

    def value(one):
        return merit_of(one.jacobian, stray(problem, one), off(problem, one))

    assert off(problem, found) < off(problem, start)
    assert value(found) > value(start)
    assert found.jacobian > min(start.jacobian, FULL) - 0.02
    assert stray(problem, found) < 0.002


def test_creases_on_their_paths_or_without_path_leave_the_mesh_unchanged():
    problem, x = wedge(1.6)
    on_paths, loose = state(problem, x), released(problem, x)
    matching = match(problem, x)
    assert recover_creases(problem, matching, on_paths, ROUNDS) is on_paths
    assert recover_creases(problem, no_features(), loose, ROUNDS) is loose
    assert recover_creases(problem, matching, loose, 0) is loose
