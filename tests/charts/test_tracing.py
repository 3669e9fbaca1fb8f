import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.charts.mapped_surface import Sheet
from polycube.charts.tracing import Drawing, near
from tests.fixtures.surfaces import box, torus


def drawing(surface, taken=()) -> Drawing:
    faces = np.arange(len(surface.faces))
    return Drawing(Sheet(surface.vertices, surface.vertices, surface.faces, faces), taken)


def length(sheet, sides):
    return sides.length


def test_the_shortest_path_with_a_least_number_of_edges():
    pen = drawing(box())
    assert pen.draw(0, (0, 1), length, least=4)
    places = pen.sheet.vertices[pen.paths[0]]
    np.testing.assert_allclose(places[:, 2], np.linspace(0, 1, 9))
    np.testing.assert_allclose(places[:, :2], 0)


def test_edges_between_used_vertices_are_halved():
    pen = drawing(box(), range(8))  # all 18 edges join corners
    assert len(pen.sheet.vertices) == 26
    assert not pen.taken()[pen.sheet.faces].all(axis=1).any()


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_paths_do_not_cross_and_any_two_points_of_a_region_can_be_joined(seed):
    """Paths from one corner of a box: a tree does not divide a sphere, so none is blocked."""
    pen = drawing(box(), range(8))
    order = np.random.default_rng(seed).permutation(7) + 1
    for name, goal in enumerate(order.tolist()):
        assert pen.draw(name, (0, goal), length)
    inner = np.concatenate([path[1:-1] for path in pen.paths.values()])
    assert len(np.unique(inner)) == len(inner) and (inner > 7).all()
    assert pen.regions().max() == 0
    assert pen.drawn().sum() == sum(len(path) - 1 for path in pen.paths.values())


def test_closed_lines_make_regions():
    pen = drawing(box(), range(8))
    for name, ends in enumerate([(0, 2), (2, 6), (6, 4), (4, 0)]):  # the rim of the face z = 0
        corners = pen.sheet.vertices[list(ends)]
        assert pen.draw(name, ends, near(corners, 0.05))
    region = pen.regions()
    bottom = pen.sheet.vertices[pen.sheet.faces][..., 2].max(axis=1) == 0
    assert region.max() == 1 and len(set(region[bottom])) == len(set(region[~bottom])) == 1
    assert pen.regions(bottom).max() == 0 and len(pen.regions(bottom)) == bottom.sum()
    assert not pen.draw(9, (1, 0), lambda sheet, sides: np.full(len(sides.ends), np.inf))


def test_a_path_leaves_in_its_sector():
    pen = drawing(torus())
    start = pen._leaving(0, None)[0]
    ring = [start, *pen._leaving(0, (start, start))]
    assert len(ring) == 6 and set(ring) == set(pen._leaving(0, None))
    first, last = ring[1], ring[3]
    assert pen._leaving(0, (first, last)) == [ring[2]]
    goal = ring[5]  # a neighbour, but on the other side
    assert pen.draw(0, (0, goal), length, ((first, last), None))
    assert pen.paths[0][1] == ring[2] and pen.paths[0][-1] == goal


def test_the_cost_of_a_side_on_the_line_is_its_length():
    pen = drawing(box())
    cost = near(np.array([[0, 0, 0], [0, 0, 1.0]]), 0.5)(pen.sheet, pen.sides)
    assert cost[(pen.sides.ends == [0, 1]).all(axis=1)] == 1
    far = (pen.sides.ends == [2, 3]).all(axis=1)  # parallel, at distance 1: 1 + (1 / 0.5)^2
    np.testing.assert_allclose(cost[far], 5)
