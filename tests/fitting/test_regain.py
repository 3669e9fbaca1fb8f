"""Creases that gave way come back, for no hex that counts."""

import numpy as np
import pytest

from polycube.fitting.body import Body
from polycube.fitting.creases.features import match, no_features
from polycube.fitting.regain import regain
from polycube.fitting.snapping import State, cover_of, goals_of, snap
from polycube.fitting.worst import raise_worst
from polycube.hexmesh.hexes import hex_mesh
from polycube.hexmesh.quality import BEST_SCORE, off_creases, worth
from polycube.surface.target import target
from polycube.types import TriMesh
from tests.hexmesh.test_hexes import box

ROUNDS = 12


def wedge(slope: float) -> tuple[Body, np.ndarray]:
    """4^3 hexes in a box of which one side slopes outwards, all creases held; unit scale."""

    def sloped(vertices):
        return vertices * (1 + slope * vertices[:, 2:] / 4 * [1, 0, 0])

    vertices, cubes = box(4, 4, 4)
    solid, one = box(1, 1, 1)
    quads = hex_mesh(solid, one).quads
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    surface = target(TriMesh(sloped(4 * solid), faces))
    body = Body(hex_mesh(sloped(vertices), cubes), surface, 500)
    return body, surface.to_unit(body.mesh.vertices)


def state(body: Body, x: np.ndarray) -> State:
    return State(x, float(body.scaled_jacobian(x).min()), 0.0, np.ones(len(x)))


def given_way(body: Body, x: np.ndarray) -> State:
    """The worst hexes raised on the surface, creases or not."""
    every, free, lengths = np.ones(len(x)), no_features(), body.lengths(x, 2, 0.05)
    for _ in range(8):
        found = snap(body, x, goals_of(body, x, free, every), 0.3, every)
        at = goals_of(body, found.x, free, every)
        x = raise_worst(body, found.x, lengths, at, cover_of(body, found, 1.0)[0], 40.0)
    return snap(body, x, goals_of(body, x, free, every), 0.3, every)


def off(body: Body, found: State) -> float:
    return off_creases(body.target, found.x[body.sides])


def stray(body: Body, found: State) -> float:
    outer = found.x[body.outer]
    return float(np.linalg.norm(body.target.closest(outer)[0] - outer, axis=1).max())


def test_an_edge_that_gave_way_for_nothing_comes_back():
    body, x = wedge(0.5)
    moved = x.copy()
    top = np.isclose(x[:, 2], x[:, 2].max()) & np.isclose(x[:, 0], x[:, 0].max())
    moved[top & (np.abs(x[:, 1]) < 0.9 * x[:, 1].max()), 0] -= 0.03  # but its ends, on the top
    start = state(body, moved)
    assert off(body, start) > 0.01
    found = regain(body, match(body, x), start, ROUNDS)
    assert off(body, found) < 1e-6
    assert stray(body, found) < 1e-9
    assert found.jacobian > start.jacobian


@pytest.mark.parametrize("slope", [1.0, 1.6, 2.2])
def test_what_counts_in_the_worst_hex_is_not_given(slope):
    body, x = wedge(slope)
    start = given_way(body, x)
    assert off(body, start) > 0.005
    found = regain(body, match(body, x), start, ROUNDS)

    def value(one):
        return worth(one.jacobian, stray(body, one), off(body, one))

    assert off(body, found) < off(body, start)
    assert value(found) > value(start)
    assert found.jacobian > min(start.jacobian, BEST_SCORE) - 0.02
    assert stray(body, found) < 0.002


def test_creases_that_hold_or_have_no_path_leave_the_mesh_as_it_is():
    body, x = wedge(1.6)
    held, loose = state(body, x), given_way(body, x)
    matching = match(body, x)
    assert regain(body, matching, held, ROUNDS) is held
    assert regain(body, no_features(), loose, ROUNDS) is loose
    assert regain(body, matching, loose, 0) is loose
