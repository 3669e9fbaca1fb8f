import numpy as np

from polycube.hexmesh.generation.template import counts, mesh
from polycube.structure.lattice import collapse, lattice
from polycube.structure.projection import pull_back
from polycube.structure.rough_map import affine_map, identity_map
from polycube.surface.measures import triangle_vectors, unit
from tests.fixtures.polycubes import PRIMITIVES, part

SCALE, OFFSET = np.diag([10.0, 7.0, 4.0]), np.array([3.0, -5.0, 100.0])


def test_a_stretched_polycube_pulls_back_exactly():
    context = ("cube", "hole_y")
    polycube = collapse(lattice((2, 1, 1), context, PRIMITIVES))
    stretch = affine_map(polycube, SCALE, OFFSET)
    parts = counts(polycube, stretch, 1.0)
    positions = mesh(polycube, identity_map(polycube), parts).vertices
    surface = part(context, SCALE, OFFSET)
    found = pull_back(surface, mesh(polycube, stretch, parts), positions)
    expected = (surface.vertices - OFFSET) / np.diag(SCALE)
    np.testing.assert_allclose(found.positions, expected, atol=1e-9)


def test_unit_normals_follow_the_right_hand_rule_and_are_zero_without_area():
    corners = np.array([[[0, 0, 0], [2, 0, 0], [0, 3, 0]], [[0, 0, 0], [1, 1, 1], [2, 2, 2]]])
    np.testing.assert_array_equal(
        unit(triangle_vectors(corners.astype(float))), [[0, 0, 1], [0, 0, 0]]
    )
