"""Paths of creases on mesh edges: box, perturbed box, rims inside a flat patch, no path."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.fitting.creases.constraints import match
from polycube.fitting.creases.paths import find_routes
from polycube.fitting.creases.routing import crowding, net
from polycube.fitting.problem import FitProblem
from polycube.surface.curves.features import NEAR
from polycube.surface.fit_target import target
from polycube.types import Polycube, TriMesh
from tests.fixtures.polycubes import cut


def body_of(surface: trimesh.Trimesh, size: float = 0.125) -> tuple[FitProblem, np.ndarray]:
    """A unit cube of hexes about the origin, at the unit scale of the surface."""
    cube = Polycube(np.ones((1, 1, 1)), [0, 1], [0, 1], [0, 1], (1, 1, 1), ("cube",))
    goal = target(TriMesh(surface.vertices, surface.faces))
    problem = FitProblem(cut(cube, size), goal, 100)
    return problem, goal.to_unit(problem.mesh.vertices - 0.5)


def stepped(height: float = 0.25, radius: float = 0.3) -> trimesh.Trimesh:
    """A unit cube with a round boss on its top: a rim and a foot in one flat side."""
    n = 48
    angle = 2 * np.pi * np.arange(n) / n
    ring = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    square = 0.5 * ring / np.abs(ring).max(axis=1, keepdims=True)
    levels = [(square, -0.5), (square, 0.5), (ring, 0.5), (ring, 0.5 + height)]
    vertices = np.concatenate([np.column_stack([p, np.full(n, z)]) for p, z in levels])
    vertices = np.vstack([vertices, [[0, 0, -0.5], [0, 0, 0.5 + height]]])
    i, j = np.arange(n), np.roll(np.arange(n), -1)
    faces = [
        np.stack([j, i, 0 * i + 4 * n], 1),
        np.stack([3 * n + i, 3 * n + j, 0 * i + 4 * n + 1], 1),
    ]
    for k in (0, n, 2 * n):
        faces += [
            np.stack([k + i, k + j, k + n + j], 1),
            np.stack([k + i, k + n + j, k + n + i], 1),
        ]
    return trimesh.Trimesh(vertices, np.concatenate(faces), process=False)


def test_net_counts_the_hexes_at_each_edge():
    problem, x = body_of(trimesh.creation.box((1, 1, 1)), 0.25)
    found = net(problem, x)
    half = 0.5 / problem.target.scale
    middle = (x[found.start] + x[found.end]) / 2
    on_edge = (np.isclose(np.abs(middle), half).sum(axis=1)) == 2
    assert (found.hexes[on_edge] == 1).all() and (found.hexes[~on_edge] == 2).all()
    assert found.length == pytest.approx(0.25 / problem.target.scale)
    assert np.linalg.norm(found.run, axis=1) == pytest.approx(1)


def test_crowding_is_least_at_right_angles():
    quarter = np.pi / 2
    assert crowding(quarter * np.array([1, 3, 2, 1]), np.array([1, 3, 1, 2])) == pytest.approx(
        [0, 0, 1, 0.5]
    )


def test_every_edge_of_a_box_has_its_path():
    problem, x = body_of(trimesh.creation.box((1, 1, 1)))
    routes, ends, placed = find_routes(problem.target.features, problem, x)
    assert len(routes) == 12 and len(ends) == 8
    assert x[placed] == pytest.approx(problem.target.features.corners[ends])
    for route in routes:
        arc, gap = route.crease.nearest(x[route.vertices])
        assert gap == pytest.approx(0, abs=1e-12)
        assert np.diff(arc) == pytest.approx(0.125 / problem.target.scale)


def test_a_path_starts_at_the_corner_that_stands_for_its_own():
    """The other edges have paths already, so the vertex of both corners is known from them."""
    problem, x = body_of(trimesh.creation.box((1, 1, 1)))
    features = problem.target.features
    routes, _, _ = find_routes(features, problem, x)
    own = features.creases[0]
    beside = features.corners[own.ends[0]] + [NEAR / 2, 0, 0]
    moved = replace(own, ends=(len(features.corners), own.ends[1]))
    changed = replace(
        features,
        creases=(moved, *features.creases[1:]),
        corners=np.vstack([features.corners, beside]),
        is_fixed=np.ones(len(features.corners) + 1, bool),
    )
    number = {id(crease): str(k) for k, crease in enumerate(features.creases)}
    paths = {number[id(r.crease)]: r.vertices for r in routes if r.crease is not own}
    problem = FitProblem(replace(problem.mesh, paths=paths), problem.target, 100)
    found = {id(route.crease): route.vertices for route in find_routes(changed, problem, x)[0]}
    before = next(route.vertices for route in routes if route.crease is own)
    assert len(found) == 12 and found[id(moved)].tolist() == before.tolist()


@given(st.integers(0, 10**6))
@settings(max_examples=10, deadline=None)
def test_paths_of_a_perturbed_box_are_those_of_the_polycube(seed):
    problem, x = body_of(trimesh.creation.box((1, 1, 1)))
    calm = match(problem, x)
    size = 0.125 / problem.target.scale
    shaken = x + np.random.default_rng(seed).uniform(-0.2, 0.2, x.shape) * size
    wild = match(problem, shaken)
    assert _rows(wild.sides) == _rows(calm.sides)
    assert sorted(wild.corner) == sorted(calm.corner)


def _rows(sides: np.ndarray) -> list[tuple[int, ...]]:
    return sorted(map(tuple, sides.tolist()))


def test_rims_inside_a_flat_patch_are_found():
    """The hexes of the cube rise into the boss; its foot and its rim are loops in the top patch."""
    surface = stepped()
    problem, x = body_of(surface, 1 / 16)
    model = problem.target.to_model(x)
    away = np.linalg.norm(model[:, :2], axis=1)
    rise = np.clip((0.35 - away) / 0.1, 0, 1) * 0.25
    model[:, 2] += rise * np.clip(model[:, 2] + 0.5, 0, 1)
    x = problem.target.to_unit(model)
    matching = match(problem, x)
    loops = [r for r in matching.routes if r.crease.is_loop]
    assert len(matching.routes) == 14 and len(loops) == 2
    for route in loops:
        assert (np.bincount(route.sides.ravel()) <= 2).all()
        assert len(np.unique(route.vertices)) == len(route.vertices) >= 12
    used = np.concatenate([np.setdiff1d(r.vertices, matching.corner) for r in matching.routes])
    assert len(np.unique(used)) == len(used)


def test_a_crease_far_from_the_mesh_has_no_path():
    surface = trimesh.util.concatenate(
        [trimesh.creation.box((1, 1, 1)), trimesh.creation.box(bounds=[[2, 0, 0], [3, 1, 1]])]
    )
    cube, _ = body_of(trimesh.creation.box((1, 1, 1)))
    goal = target(TriMesh(surface.vertices, surface.faces))
    problem = FitProblem(cube.mesh, goal, 100)
    routes, ends, _ = find_routes(goal.features, problem, goal.to_unit(problem.mesh.vertices - 0.5))
    assert len(goal.features.creases) == 24
    assert len(routes) == 12 and len(ends) == 8


def test_creases_closer_than_a_hex_do_not_share_vertices():
    """Rim and foot of a boss a third of a hex high: both have separate paths, or only one has."""
    problem, x = body_of(stepped(height=0.02), 1 / 16)
    matching = match(problem, x)
    used = np.concatenate([np.setdiff1d(r.vertices, matching.corner) for r in matching.routes])
    assert len(np.unique(used)) == len(used)
    assert 1 <= sum(r.crease.is_loop for r in matching.routes) <= 2
