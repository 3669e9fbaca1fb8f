"""What a body measures of its mesh."""

import numpy as np
import pytest
import trimesh

from polycube.fitting.body import Body
from polycube.hexmesh import energy
from polycube.hexmesh.hexes import EDGES, hex_mesh
from polycube.surface.target import target
from polycube.types import TriMesh
from tests.hexmesh.test_hexes import box


@pytest.fixture(scope="module")
def body() -> Body:
    """A block of 20 x 20 x 20 hexes: more than one thread's share."""
    solid = trimesh.creation.box()
    return Body(hex_mesh(*box(20, 20, 20)), target(TriMesh(solid.vertices, solid.faces)), 10)


def test_lengths_of_a_box_are_its_sides(body):
    x = body.mesh.vertices * [1.0, 2.0, 3.0]
    assert body.lengths(x, 0, 0.0) == pytest.approx(np.tile([1.0, 2.0, 3.0], (8000, 1)))
    even = body.lengths(x, 2, 1.0)
    assert even == pytest.approx(np.full((8000, 3), 6 ** (1 / 3)))


def test_lengths_are_means_of_four_edges(body):
    x = body.mesh.vertices + np.random.default_rng(0).uniform(-0.3, 0.3, body.mesh.vertices.shape)
    ends = x[body.hexes[:, EDGES]]
    length = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2)
    assert body.lengths(x, 0, 0.0) == pytest.approx(length.reshape(-1, 3, 4).mean(axis=2))


def test_scaled_jacobians_in_parts_are_those_of_the_whole(body):
    x = body.mesh.vertices + np.random.default_rng(0).uniform(-0.3, 0.3, body.mesh.vertices.shape)
    assert np.array_equal(body.scaled_jacobian(x), energy.scaled_jacobian(x, body.hexes))
