"""Polishing: better hexes, boundary on the surface, and never worse than the input."""

import numpy as np
import pytest
import trimesh

from polycube.fitting import polish as module
from polycube.fitting.creases.constraints import goals, no_features
from polycube.fitting.pillow import layer
from polycube.fitting.polish import polish
from polycube.fitting.problem import FitProblem
from polycube.fitting.registration import register_mesh
from polycube.fitting.snapping import State, snap
from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.quality import deviation
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.numerics.lbfgs import counted
from polycube.surface.fit_target import target
from polycube.types import HexMesh, TriMesh
from tests.fixtures.fitting import cube, sphere
from tests.fixtures.hexmeshes import unit_cubes
from tests.fixtures.machined import bored


def worst(mesh: HexMesh) -> float:
    return float(scaled_jacobian(mesh.vertices, mesh.hexes).min())


def test_a_pillowed_ball():
    ball = sphere(3.0, 7.0)
    start = cube(4)
    start = hex_mesh(start.vertices * 3 + 7, start.hexes)
    start = register_mesh(start, target(ball))
    layered = register_mesh(
        layer(start, start.patch, start.patch == 0), target(ball), rounds=4, alpha=(0.04, 0.04)
    )
    mesh = polish(layered, target(ball), soft_rounds=10, hard_rounds=10)
    assert worst(mesh) > max(0.6, worst(layered))
    assert deviation(mesh, ball).vertices < 1e-9


def test_boundary_reaches_the_sharp_edges_of_a_box():
    solid = trimesh.creation.box((1, 2, 3))
    surface = TriMesh(solid.vertices, solid.faces)
    rng = np.random.default_rng(0)
    vertices, cubes = unit_cubes(3, 4, 6)
    start = (vertices / [3, 4, 6] - 0.5) * [1, 2, 3] + 0.03 * rng.normal(size=vertices.shape)
    mesh = hex_mesh(start, cubes, patch=_sides(vertices, cubes))
    mesh = polish(mesh, target(surface), soft_rounds=8, hard_rounds=8)
    on = np.isclose(np.abs(mesh.vertices), [0.5, 1, 1.5], atol=1e-9).sum(axis=1)
    wanted = np.isclose(np.abs(vertices / [3, 4, 6] - 0.5), 0.5).sum(axis=1)
    assert np.array_equal(on, wanted)
    assert worst(mesh) > 0.95


def test_held_vertices_on_curved_faces_do_not_slide():
    """Of a hole through a block whose quads are twisted; what is inside and on planes moves."""
    surface = bored(48)
    angle = (
        2 * np.pi * (np.arange(16) + 0.2 * (np.arange(16) % 2)) / 16
    )  # an uneven polygon in a square
    circle, square = (np.stack([np.cos(a), np.sin(a)], axis=1) for a in (angle + 0.7, angle))
    outer = 2 * square / np.abs(square).max(axis=1, keepdims=True)
    flat = np.concatenate([circle, (circle + outer) / 2, outer])
    ring = np.arange(48).reshape(3, 16)
    inner, after = ring[:-1].ravel(), np.roll(ring, -1, axis=1)
    quads = np.stack([inner, ring[1:].ravel(), after[1:].ravel(), after[:-1].ravel()], axis=1)
    levels = [np.column_stack([flat, np.full(48, z)]) for z in (0.0, 1, 2)]
    cells = np.concatenate([quads, quads + 48], axis=1)
    mesh = hex_mesh(np.concatenate(levels), np.concatenate([cells, cells + 48]))
    is_held = np.linalg.norm(mesh.vertices[:, :2], axis=1) < 1.01
    options = {"hold": True}, {"hold": True, "free_below": 0.9}, {"hold": False}
    held, freed, free = (polish(mesh, target(surface), exact=True, **each) for each in options)
    moved, *slid = (np.linalg.norm(m.vertices - mesh.vertices, axis=1) for m in (held, freed, free))
    assert moved[is_held].max() < 5e-3 and moved[~is_held].max() > 0.02
    assert min(each[is_held].max() for each in slid) > 0.02
    assert worst(mesh) - 1e-3 < worst(held) < worst(freed)


def _sides(vertices: np.ndarray, cubes: np.ndarray) -> np.ndarray:
    """Number the six sides of a box."""
    mesh = hex_mesh(vertices, cubes)
    a, b, c, d = np.moveaxis(vertices[mesh.quads], 1, 0)
    normal = np.cross(c - a, d - b)
    axis = np.abs(normal).argmax(axis=1)
    return 2 * axis + (np.take_along_axis(normal, axis[:, None], 1)[:, 0] < 0)


def test_never_worse_than_before():
    """A perfect mesh on the surface cannot be improved."""
    solid = trimesh.creation.box(bounds=[[0, 0, 0], [3, 3, 3]])
    vertices, cubes = unit_cubes(3, 3, 3)
    mesh = hex_mesh(vertices, cubes)
    goal = target(TriMesh(solid.vertices, solid.faces))
    assert worst(polish(mesh, goal, soft_rounds=2, hard_rounds=2)) == pytest.approx(1)


def test_a_tangled_mesh_becomes_valid():
    rng = np.random.default_rng(3)
    start = cube(3)
    tangled = hex_mesh(start.vertices + 0.3 * rng.normal(size=start.vertices.shape), start.hexes)
    assert worst(tangled) < 0
    assert worst(polish(tangled, target(sphere()), soft_rounds=3, hard_rounds=3)) > 0


def test_local_rounds_gain_and_keep_the_surface_covered():
    ball = sphere(3.0, 7.0)
    start = cube(4)
    start = register_mesh(hex_mesh(start.vertices * 3 + 7, start.hexes), target(ball), rounds=10)
    soft = {"soft_rounds": 6, "hard_rounds": 2}
    plain = polish(start, target(ball), **soft, local_rounds=0)
    raised = polish(start, target(ball), **soft)
    assert worst(raised) > worst(plain) + 0.02
    before, after = deviation(plain, ball), deviation(raised, ball)
    assert after.vertices < 1e-3
    # the gain is larger than the penalty of polish for the uncovered surface
    lost = max(0.0, after.to_mesh.p99 - before.to_mesh.p99)
    assert worst(raised) - worst(plain) > module.UNCOVERED * lost
    assert after.to_mesh.p99 < 0.02


def test_a_longer_run_reuses_the_rounds_of_a_short_one():
    """Soft and hard rounds are run once; the result has the same bytes as without the cache."""
    ball = sphere(3.0, 7.0)
    start = cube(4)
    start = register_mesh(hex_mesh(start.vertices * 3 + 7, start.hexes), target(ball), rounds=10)
    rounds = {"soft_rounds": 3, "hard_rounds": 2}
    alone = polish(start, target(ball), **rounds, local_rounds=8)
    module._after_soft_and_hard.cache_clear()
    with counted() as first:
        polish(start, target(ball), **rounds, local_rounds=2)
    with counted() as second:
        after = polish(start, target(ball), **rounds, local_rounds=8)
    assert np.array_equal(after.vertices, alone.vertices)
    assert 0 < second["steps"] and first["steps"] > 100 and second["steps"] < 8 * 30 + 1


def test_a_valid_state_beats_every_other():
    x, trust = np.zeros((1, 3)), np.ones(1)
    valid, close = State(x, 0.01, 0.5, trust), State(x, -0.01, 0.0, trust)
    assert valid.score > close.score


def test_snap_moves_less_far_if_a_hex_would_become_too_bad():
    """The closest point of a vertex is beyond its hex: the snap stops before."""
    start = cube(3)
    problem = FitProblem(start, target(sphere()), 100)
    x = problem.target.to_unit(start.vertices)
    at = goals(problem, x, no_features(), 0.04, np.ones(len(x), bool))
    at.foot[0] = x[problem.outer[0]] + 2 * (x.mean(axis=0) - x[problem.outer[0]])
    least = 0.3
    free = snap(problem, x, at, -2.0, np.ones(len(x)))
    assert free.jacobian < 0 and free.residual == pytest.approx(0, abs=1e-12)
    state = snap(problem, x, at, least, np.ones(len(x)))
    assert state.jacobian >= least
    assert state.residual > 0.1
    assert state.score < state.jacobian


def test_a_state_on_exact_features_beats_better_hexes_off_them():
    x, trust = np.zeros((1, 3)), np.ones(1)
    on, off = State(x, 0.05, 0.0, trust), State(x, 0.6, 0.006, trust, strayed=0.0035)
    assert on.score > off.score
