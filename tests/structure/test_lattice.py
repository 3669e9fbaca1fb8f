import itertools

import numpy as np
import pytest

from polycube.structure.lattice import (
    boundary,
    cell_at,
    cell_of_box,
    collapse,
    corners,
    describe,
    genus,
    is_manifold,
    lattice,
)
from polycube.types import Polycube
from tests.fixtures.polycubes import ONE, PRIMITIVES, TWO, edges

CONTEXTS = [(ONE, (name,)) for name in PRIMITIVES] + [
    (TWO, pair) for pair in itertools.product(PRIMITIVES, repeat=2)
]
CONTEXTS += [(TWO, pair) for name in PRIMITIVES for pair in ((name, None), (None, name))]


def counts(polycube: Polycube) -> tuple[int, int, int]:
    surface = boundary(polycube)
    return surface.patch.max() + 1, len(edges(surface)[0]), len(corners(surface))


def area(surface) -> np.ndarray:
    a, b, c, d = np.moveaxis(surface.vertices[surface.quads], 1, 0)
    return np.cross(c - a, d - b) / 2


def test_cube_has_six_faces_twelve_edges_eight_corners():
    cube = lattice(ONE, ("cube",), PRIMITIVES)
    assert cube.occupancy.shape == (3, 3, 3)
    assert counts(cube) == counts(collapse(cube)) == (6, 12, 8)
    assert collapse(cube).occupancy.shape == (1, 1, 1)
    assert genus(cube) == 0


@pytest.mark.parametrize("name", ["hole_x", "hole_y", "hole_z"])
def test_hole_has_ten_faces_and_genus_one(name):
    hole = lattice(ONE, (name,), PRIMITIVES)
    assert counts(hole) == (10, 24, 16)
    assert genus(hole) == 1


def test_outward_quads_bound_the_volume():
    polycube = lattice(TWO, ("hole_y", "hole_x"), PRIMITIVES)
    surface = boundary(polycube)
    normal = area(surface)
    middle = surface.vertices[surface.quads].mean(axis=1)
    volume = (middle * normal).sum() / 3
    assert volume == pytest.approx(polycube.occupancy.sum() / 27)
    direction = np.argmax(np.abs(normal), axis=1) * 2 + (normal.sum(axis=1) < 0)
    assert (surface.axis == direction).all()
    low = np.argwhere(polycube.occupancy)[surface.box] / 3
    assert (np.abs(middle - low - 1 / 6).max(axis=1) < 1 / 6 + 1e-12).all()


@pytest.mark.parametrize(("grid", "context"), CONTEXTS)
def test_every_context_of_two_cells_is_one_closed_solid(grid, context):
    polycube = lattice(grid, context, PRIMITIVES)
    surface = boundary(polycube)
    vertices, quads = len(surface.vertices), len(surface.quads)
    assert is_manifold(polycube)
    assert vertices - quads == 2 - 2 * genus(polycube)  # a closed quad surface has 2Q edges
    np.testing.assert_allclose(area(surface).sum(axis=0), 0, atol=1e-12)
    for number in range(surface.patch.max() + 1):
        mine = surface.patch == number
        axis = surface.axis[mine][0]
        level = surface.vertices[surface.quads[mine], axis // 2]
        assert (surface.axis[mine] == axis).all() and np.ptp(level) == 0


@pytest.mark.parametrize(("grid", "context"), CONTEXTS)
def test_collapse_keeps_the_solid(grid, context):
    full = lattice(grid, context, PRIMITIVES)
    small = collapse(full)
    middle = [
        np.searchsorted(knots, np.arange(0.5, 3 * n) / 3, "right") - 1
        for knots, n in zip(small.knots, grid, strict=True)
    ]
    inside = [(m >= 0) & (m < n) for m, n in zip(middle, small.occupancy.shape, strict=True)]
    boxes = np.ix_(*[m[i] for m, i in zip(middle, inside, strict=True)])
    np.testing.assert_array_equal(small.occupancy[boxes], full.occupancy[np.ix_(*inside)])
    assert small.occupancy[boxes].sum() == full.occupancy.sum()
    assert counts(small) == counts(full) and genus(small) == genus(full)
    np.testing.assert_array_equal(collapse(small).occupancy, small.occupancy)


def test_contexts_of_two_full_cells_collapse_to_fourteen_templates():
    solids = [
        collapse(lattice(TWO, pair, PRIMITIVES)).occupancy
        for pair in itertools.product(PRIMITIVES, repeat=2)
    ]
    assert len({(solid.shape, solid.tobytes()) for solid in solids}) == 14


def test_a_closed_hole_and_two_loops_have_their_genus():
    assert genus(lattice(TWO, ("hole_x", "cube"), PRIMITIVES)) == 0
    assert genus(lattice(TWO, ("hole_x", "hole_x"), PRIMITIVES)) == 1
    assert genus(lattice(TWO, ("hole_x", "hole_y"), PRIMITIVES)) == 1
    assert genus(lattice(TWO, ("hole_y", "hole_z"), PRIMITIVES)) == 2


@pytest.mark.parametrize("other", [(1, 1, 0), (1, 1, 1)])
def test_boxes_that_touch_at_an_edge_or_vertex_are_not_manifold(other):
    occupancy = np.zeros((2, 2, 2), bool)
    occupancy[0, 0, 0] = occupancy[other] = True
    knots = [np.array([0, 0.5, 1])] * 3
    assert not is_manifold(Polycube(occupancy, *knots, ONE, ("cube",)))


def test_a_void_or_two_components_are_not_manifold():
    closed = lattice((3, 1, 1), ("cube", "hole_x", "hole_y"), PRIMITIVES)  # the hole has no mouth
    apart = lattice((3, 1, 1), ("cube", None, "hole_y"), PRIMITIVES)
    assert not is_manifold(closed) and not is_manifold(apart)


def test_an_empty_lattice_is_not_manifold():
    knots = [np.array([0.0, 1])] * 3
    assert not is_manifold(Polycube(np.zeros((1, 1, 1), bool), *knots, ONE, (None,)))


def test_cells_of_points_and_boxes():
    polycube = lattice((2, 1, 1), ("hole_x", "cube"), PRIMITIVES)
    cells = cell_of_box(polycube)
    np.testing.assert_array_equal(np.bincount(cells), [24, 27])
    points = np.array([[0.1, 0.5, 0.5], [1.9, 0, 0], [2.0, 1, 1]])
    np.testing.assert_array_equal(cell_at(polycube, points), [0, 1, 1])


def test_invalid_names_and_lengths_are_refused():
    with pytest.raises(LookupError, match="no primitive named 'sphere'"):
        lattice(ONE, ("sphere",), PRIMITIVES)
    with pytest.raises(ValueError, match="needs 2 cells"):
        lattice(TWO, ("cube",), PRIMITIVES)


def test_description_names_few_cells_and_gives_the_shape_of_many():
    assert describe(lattice(TWO, ("hole_x", None), PRIMITIVES)) == "hole_x, -"
    many = collapse(lattice((3, 1, 3), (*["cube"] * 4, None, *["cube"] * 4), PRIMITIVES))
    assert describe(many) == "3x1x3 bricks, 8 full"
