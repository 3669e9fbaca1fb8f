"""Sharp edges of a cube found by a box of hexes in it."""

import numpy as np
import pytest
import trimesh

from polycube.geometry.body import Body
from polycube.geometry.features import chains, goals, match, no_features, sharpness
from polycube.geometry.lattice import boundary, edges
from polycube.geometry.target import target
from polycube.types import Polycube, TriMesh
from tests.geometry.test_template import cut, ring


def cube_body(surface: trimesh.Trimesh, turn: float = 0.0) -> tuple[Body, np.ndarray]:
    """A unit cube of hexes, at the unit scale of the surface; turned about z by an angle."""
    cube = Polycube(np.ones((1, 1, 1)), [0, 1], [0, 1], [0, 1], (1, 1, 1), ("cube",))
    goal = target(TriMesh(surface.vertices, surface.faces))
    body = Body(cut(cube, 0.25), goal, 100)
    c, s = np.cos(turn), np.sin(turn)
    x = (body.mesh.vertices - 0.5) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    return body, x / goal.scale


def unit_box() -> trimesh.Trimesh:
    return trimesh.creation.box((1, 1, 1))


def test_chains_are_the_edges_of_the_polycube():
    goal = target(TriMesh(unit_box().vertices, unit_box().faces))
    mesh = cut(ring(), 1 / 6)
    found = chains(Body(mesh, goal, 10))
    ends, patches = edges(boundary(ring()))
    assert len(found.patches) == len(ends) == 24
    assert sorted(found.patches.tolist()) == sorted(patches.tolist())
    for number, pair in enumerate(found.patches):
        here = found.number == number
        assert (np.sort(mesh.patch[found.quads[here]], axis=1) == pair).all()


def test_all_edges_of_a_cube_are_sharp_and_none_of_a_ball():
    body, x = cube_body(unit_box())
    assert sharpness(body, x, chains(body)) == pytest.approx(1)
    body, x = cube_body(trimesh.creation.icosphere(subdivisions=2))
    assert not sharpness(body, x, chains(body)).any()
    assert len(match(body, x).curve) == len(match(body, x).corner) == 0


def test_matching_of_a_cube():
    body, x = cube_body(unit_box())
    matching = match(body, x)
    assert len(matching.curve) == 12 * 3
    assert len(matching.corner) == 8
    assert matching.corner_goal == pytest.approx(x[matching.corner])


def test_goals_are_on_the_surface_its_edges_and_corners():
    body, x = cube_body(unit_box(), turn=0.1)
    at = goals(body, x, match(body, x), 0.04, np.ones(len(x), bool))
    place = at.place(body, x)
    half = 0.5 / body.target.scale
    on = np.isclose(np.abs(place[body.outer]), half, atol=1e-12).sum(axis=1)
    assert np.bincount(on).tolist() == [0, 6 * 9, 12 * 3, 8]
    assert np.abs(at.direction).max(axis=1) == pytest.approx(1)
    assert np.array_equal(np.delete(place, body.outer, axis=0), np.delete(x, body.outer, axis=0))


def test_springs_hold_across_edges_and_at_corners():
    body, x = cube_body(unit_box())
    at = goals(body, x, match(body, x), 0.04, np.ones(len(x), bool))
    edge, corner = at.springs(np.full(len(x), 2.0))
    assert np.array_equal(edge.vertex[:, 0], at.curve) and (edge.along == -2).all()
    assert (corner.along == 0).all() and (corner.every == 2).all()


def test_unused_features_are_left_out():
    body, x = cube_body(unit_box())
    at = goals(body, x, match(body, x), 0.04, np.zeros(len(x), bool))
    assert len(at.curve) == len(at.corner) == 0
    at = goals(body, x, no_features(), 0.04, np.ones(len(x), bool))
    assert len(at.curve) == len(at.corner) == 0


def test_an_edge_across_the_chain_is_no_goal():
    """One sharp ridge: the chains across it may not snap to it."""
    body, x = cube_body(unit_box())
    matching = match(body, x)
    fooled = matching.sides[np.abs(x[matching.sides[:, 0]] - x[matching.sides[:, 1]])[:, 2] > 0.01]
    crossing = type(matching)(
        fooled, np.unique(fooled), matching.corner[:0], matching.corner_goal[:0]
    )
    at = goals(body, x[:, [1, 2, 0]], crossing, 0.04, np.ones(len(x), bool))
    assert np.abs(at.direction[:, 1]) == pytest.approx(1)


def test_few_features_are_no_trouble():
    """A surface with a single sharp edge: fewer segments than any neighbour search would want."""
    tent = trimesh.creation.icosphere(subdivisions=2)
    vertices = np.array(tent.vertices)
    vertices[tent.faces[0, 0]] *= 1.6
    body, x = cube_body(trimesh.Trimesh(vertices, tent.faces, process=False))
    assert 0 < len(body.target.features.segments) < 12
    sides = body.sides[:4]
    matching = type(match(body, x))(sides, np.unique(sides), np.zeros(0, int), np.zeros((0, 3)))
    at = goals(body, x, matching, 0.04, np.ones(len(x), bool))
    assert len(at.curve) <= len(matching.curve)
