"""Boundaries that cross themselves at a few places: repaired, or returned unchanged."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.fitting.uncrossing import MOST, SHARES, without_crossings
from polycube.hexmesh.crossings import crossings
from polycube.hexmesh.generation.graded_lattice import graded
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.surface.fit_target import Target, target
from polycube.types import HexMesh, TriMesh

FULL = np.ones((10, 8, 4), bool)
FULL[4:6, 2:] = False  # a slot between two legs, of hexes two cells wide


def slot(radius: float = 0.1, **moves: tuple[float, float, float]) -> HexMesh:
    """Two legs with a slot from 4 to 6 along x; vertices of its sides move.

    radius : how far those that move are from the middle of the side, `left` or `right`
    """
    mesh = graded(FULL, [np.zeros_like(FULL)])
    vertices = mesh.vertices.copy()
    for side, move in moves.items():
        x = 4 if side == "left" else 6
        is_on = (mesh.vertices[:, 0] == x) & (mesh.vertices[:, 1] > 2)
        vertices[is_on & (np.linalg.norm(mesh.vertices - [x, 6, 2], axis=1) < radius)] += move
    return replace(mesh, vertices=vertices)


def own_surface(mesh: HexMesh) -> Target:
    """Fit target that is the boundary of the mesh itself."""
    return target(TriMesh(mesh.vertices, mesh.quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)))


@pytest.fixture(scope="module")
def goal() -> Target:
    return own_surface(slot())


def test_a_vertex_in_the_other_leg_moves_back_as_little_as_possible(goal):
    before = slot(left=(2.15, 0, 0))
    assert len(crossings(before))
    assert scaled_jacobian(before.vertices, before.hexes).min() > 0
    after = without_crossings(before, goal)
    assert not len(crossings(after))
    assert scaled_jacobian(after.vertices, after.hexes).min() > 0
    moved = np.linalg.norm(after.vertices - before.vertices, axis=1)
    place = np.linalg.norm(before.vertices - [6.15, 6, 2], axis=1).argmin()
    way = moved[place] / 2.15  # its neighbours are on the side of the slot
    assert way == pytest.approx(next(share for share in SHARES if 2.15 * (1 - share) < 2))
    corners = np.unique(before.quads[np.unique(crossings(before))])
    assert set(np.flatnonzero(moved)) <= set(corners.tolist())


def test_a_mesh_without_crossings_is_unchanged(goal):
    mesh = slot(left=(1.5, 0, 0))
    assert without_crossings(mesh, goal) is mesh


def test_a_vertex_far_in_the_other_leg_moves_back_and_hexes_are_untangled(goal):
    before = slot(left=(5.0, 0, 0))
    assert len(crossings(before))
    after = without_crossings(before, goal)
    assert not len(crossings(after))
    assert scaled_jacobian(after.vertices, after.hexes).min() > 0
    moved = np.linalg.norm(after.vertices - before.vertices, axis=1) > 1e-9
    place = np.array([4.0, 6, 2])
    assert np.linalg.norm(slot().vertices[moved] - place, axis=1).max() < 8  # three hexes away


def test_a_mesh_that_cannot_be_repaired_is_unchanged(goal):
    many = slot(radius=3.0, left=(2.15, 0, 0))
    assert len(crossings(many)) > MOST and scaled_jacobian(many.vertices, many.hexes).min() > 0
    assert without_crossings(many, goal) is many
    inverted = slot(left=(2.15, 0, 0), right=(3.0, 0, 0))
    assert scaled_jacobian(inverted.vertices, inverted.hexes).min() <= 0
    assert without_crossings(inverted, goal) is inverted
