"""Sharp edges of a cube that are matched with a box of hexes inside it."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.fitting.creases.constraints import (
    Matching,
    goals,
    match,
    no_features,
    with_tolerances,
)
from polycube.fitting.creases.paths import Route
from polycube.fitting.pillow import borders
from polycube.fitting.problem import FitProblem
from polycube.structure.lattice import boundary
from polycube.surface import arc_length
from polycube.surface.curves.features import Crease
from polycube.surface.fit_target import target
from polycube.types import Polycube, TriMesh
from tests.fixtures.polycubes import cut, edges, ring


def cube_body(surface: trimesh.Trimesh, turn: float = 0.0) -> tuple[FitProblem, np.ndarray]:
    """A unit cube of hexes at the unit scale of the surface, rotated about z by `turn`."""
    cube = Polycube(np.ones((1, 1, 1)), [0, 1], [0, 1], [0, 1], (1, 1, 1), ("cube",))
    goal = target(TriMesh(surface.vertices, surface.faces))
    problem = FitProblem(cut(cube, 0.25), goal, 100)
    c, s = np.cos(turn), np.sin(turn)
    x = (problem.mesh.vertices - 0.5) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    return problem, x / goal.scale


def unit_box() -> trimesh.Trimesh:
    return trimesh.creation.box((1, 1, 1))


def test_borders_of_patches_are_the_edges_of_the_polycube():
    goal = target(TriMesh(unit_box().vertices, unit_box().faces))
    mesh = cut(ring(), 1 / 6)
    problem = FitProblem(mesh, goal, 10)
    side, border, found = borders(problem, mesh.patch)
    ends, patches = edges(boundary(ring()))
    assert len(found) == len(ends) == 24
    assert sorted(found.tolist()) == sorted(patches.tolist())
    for number, pair in enumerate(found):
        quads = problem.side_quads[side[border == number]]
        assert (np.sort(mesh.patch[quads], axis=1) == pair).all()


def test_every_edge_of_a_cube_has_its_four_sides():
    problem, _ = cube_body(unit_box())
    _, border, _ = borders(problem, problem.mesh.patch)
    assert np.bincount(border).tolist() == 12 * [4]


def test_chord_error_reduces_the_permitted_distance():
    line = Crease(np.array([[0.0, 0, 0], [1, 0, 0]]), np.array([0.0, 1.0]), np.ones(1), (0, 1))
    loop = circle(720)
    size = loop.length / (2 * np.pi)  # its radius
    found = [Route(line, np.arange(5)), Route(loop, np.arange(5, 25))]
    assert found[0].sagitta == pytest.approx(0, abs=1e-12)
    assert found[1].sagitta == pytest.approx(size * (1 - np.cos(np.pi / 20)), rel=1e-3)
    small = Route(replace(loop, points=0.1 * loop.points, arc=0.1 * loop.arc), np.arange(25, 45))
    matching = Matching((*found, small), np.zeros(0, int), np.zeros((0, 3)))
    allowed = with_tolerances(matching, 50).allowed
    assert (allowed[:5] == allowed[45:]).all() and allowed[0] == 0.0025
    assert (allowed[5:25] == 0.0005).all()
    assert allowed[25:45] == pytest.approx(0.0025 - small.sagitta)


def test_a_ball_has_nothing_to_match():
    problem, x = cube_body(trimesh.creation.icosphere(subdivisions=2))
    matching = match(problem, x)
    assert len(matching.curve) == len(matching.corner) == len(matching.sides) == 0


def test_matching_of_a_cube():
    problem, x = cube_body(unit_box())
    matching = match(problem, x)
    assert len(matching.curve) == 12 * 3
    assert len(matching.corner) == 8
    assert matching.corner_goal == pytest.approx(x[matching.corner])


def test_goals_are_on_the_surface_its_edges_and_corners():
    problem, x = cube_body(unit_box(), turn=0.1)
    at = goals(problem, x, match(problem, x), 0.04, np.ones(len(x), bool))
    place = at.place(problem, x)
    half = 0.5 / problem.target.scale
    on = np.isclose(np.abs(place[problem.outer]), half, atol=1e-12).sum(axis=1)
    assert np.bincount(on).tolist() == [0, 6 * 9, 12 * 3, 8]
    assert np.abs(at.direction).max(axis=1) == pytest.approx(1)
    assert np.array_equal(
        np.delete(place, problem.outer, axis=0), np.delete(x, problem.outer, axis=0)
    )


def test_springs_hold_across_edges_and_at_corners():
    problem, x = cube_body(unit_box())
    at = goals(problem, x, match(problem, x), 0.04, np.ones(len(x), bool))
    edge, corner = at.springs(np.full(len(x), 2.0))
    assert np.array_equal(edge.vertex[:, 0], at.curve) and (edge.along == -2).all()
    assert (corner.along == 0).all() and (corner.every == 2).all()


def test_goals_without_unused_features():
    problem, x = cube_body(unit_box())
    at = goals(problem, x, match(problem, x), 0.04, np.zeros(len(x), bool))
    assert len(at.curve) == len(at.corner) == 0
    at = goals(problem, x, no_features(), 0.04, np.ones(len(x), bool))
    assert len(at.curve) == len(at.corner) == 0


def circle(n: int) -> Crease:
    """Radius 1 about the origin in the plane z = 0."""
    angle = 2 * np.pi * np.arange(n + 1) / n
    points = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    arc = np.append(0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    return Crease(points, arc, np.full(n, np.pi / 2), (-1, -1))


def spread(route: Route, x: np.ndarray) -> np.ndarray:
    """(N,) ascending arc lengths of the vertices of a route."""
    crease = route.crease
    return arc_length.spread(crease.points, crease.arc, crease.is_loop, x[route.vertices])


def line(length: float) -> Crease:
    points = np.array([[0.0, 0, 0], [length, 0, 0]])
    return Crease(points, np.array([0, length]), np.array([np.pi / 2]), (0, 1))


def test_spread_does_not_change_ordered_positions():
    x = np.array([[0, 0.1, 0], [1, -0.2, 0], [2.5, 0, 0.3], [4, 0, 0]])
    route = Route(line(4.0), np.arange(4))
    assert spread(route, x) == pytest.approx([0, 1, 2.5, 4])


@given(st.integers(0, 10**6), st.integers(3, 12))
@settings(max_examples=40, deadline=None)
def test_spread_never_folds(seed, n):
    rng = np.random.default_rng(seed)
    x = rng.uniform(-1.5, 1.5, (n, 3))
    opened = spread(Route(line(1.0), np.arange(n)), x)
    assert (np.diff(opened) >= 0.2 / (n - 1) - 1e-12).all()
    assert 0 <= opened[0] and opened[-1] <= 1 + 1e-12
    loop = circle(30)
    closed = spread(Route(loop, np.arange(n)), x)
    around = np.append(closed, closed[0] + loop.length)
    assert (np.diff(around) >= 0.2 * loop.length / n - 1e-12).all()


def test_vertices_stay_on_their_own_crease_near_another():
    """Two parallel creases: a vertex closer to the other crease stays on its own."""
    other = Crease(line(1.0).points + np.array([0, 0.3, 0]), np.array([0, 1.0]), np.ones(1), (2, 3))
    routes = (Route(line(1.0), np.arange(3)), Route(other, np.arange(3, 6)))
    matching = Matching(routes, np.zeros(0, int), np.zeros((0, 3)))
    problem, x = cube_body(unit_box())
    x[:6] = [[0, 0, 0], [0.5, 0.25, 0], [1, 0, 0], [0, 0.3, 0], [0.5, 0.05, 0], [1, 0.3, 0]]
    at = goals(problem, x, matching, 0.04, np.ones(len(x), bool))
    assert at.curve.tolist() == list(range(6))
    assert at.curve_foot[:, 1] == pytest.approx([0, 0, 0, 0.3, 0.3, 0.3])


@given(st.integers(0, 10**6))
@settings(max_examples=40, deadline=None)
def test_spread_is_continuous_in_the_positions(seed):
    """Vertices on a loop of six segments keep their arc lengths; small moves change them little."""
    rng = np.random.default_rng(seed)
    loop = circle(6)
    step = rng.uniform(0.4, 1, 12)
    arc = rng.uniform(0, loop.length) + np.cumsum(step) / step.sum() * loop.length
    route, x = Route(loop, np.arange(12)), loop.at(arc)[0]
    turns = (spread(route, x) - arc) / loop.length
    assert turns == pytest.approx(np.round(turns[0]), abs=1e-7)
    moved = spread(route, x + rng.uniform(-1e-4, 1e-4, x.shape))
    change = (moved - arc) / loop.length
    assert change == pytest.approx(np.round(change[0]), abs=1e-4)


def plate(thickness: float) -> tuple[FitProblem, np.ndarray]:
    """A box of 4 x 4 x 1 hexes on a plate."""
    sides = Polycube(np.ones((1, 1, 1)), [0, 1], [0, 1], [0, thickness], (1, 1, 1), ("cube",))
    solid = trimesh.creation.box(bounds=[[0, 0, 0], [1, 1, thickness]])
    goal = target(TriMesh(solid.vertices, solid.faces))
    problem = FitProblem(cut(sides, 0.25), goal, 100)
    return problem, goal.to_unit(problem.mesh.vertices)


@pytest.mark.parametrize("turn", [0.0, 0.2, 0.4])
def test_closest_points_stay_on_their_side_of_a_thin_wall(turn):
    """A plate thinner than a vertex is tilted: closest points stay on the side of the vertex."""
    problem, x = plate(0.05)
    height = x[problem.outer, 2].copy()
    rng = np.random.default_rng(1)
    moved = x + np.array([0, 0, turn * 0.05]) + rng.uniform(-1e-3, 1e-3, x.shape)
    at = goals(problem, moved, no_features(), 0.04, np.zeros(len(x), bool))
    inner = (np.abs(x[problem.outer, :2]) < 0.3).all(axis=1)
    assert inner.sum() == 18
    assert at.foot[inner, 2] == pytest.approx(height[inner], abs=1e-12)


def test_closest_points_stay_on_their_face_at_a_concave_edge():
    """Vertices of a concave edge of 90 degrees are moved along the floor and stay there.

    Their normals are closer to that of the wall, because its quads are larger than those of the
    floor. In a former version, the closest point was on the wall for moves of up to 0.03.
    """
    solid = np.ones((2, 1, 2))
    solid[1, :, 1] = 0
    step = Polycube(solid, [0, 1, 2], [0, 1], [0, 1, 2], (2, 1, 2), ("cube",) * 4)
    mesh = cut(step, 0.25)
    high = replace(mesh, vertices=mesh.vertices * [1, 1, 1.5])
    quads = np.concatenate([mesh.quads[:, [0, 1, 2]], mesh.quads[:, [0, 2, 3]]])
    goal = target(TriMesh(high.vertices, quads))
    problem, x = FitProblem(high, goal, 100), goal.to_unit(high.vertices)
    seam = (mesh.vertices[:, [0, 2]] == 1).all(axis=1)
    assert seam.sum() == 5
    for out in np.linspace(0, 0.03, 7):
        moved = x + out * np.outer(seam, [1, 0, 0])
        at = goals(problem, moved, no_features(), 0.04, np.zeros(len(x), bool))
        assert at.place(problem, moved) == pytest.approx(moved, abs=1e-12)
