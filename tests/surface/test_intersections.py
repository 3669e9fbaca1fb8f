"""Crossing faces: none on clean parts, and on crossing boxes those of the slow, obvious test."""

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.surface.intersections import crossing_places, self_intersections
from polycube.surface.repair.clean import crossings
from polycube.types import TriMesh
from tests.fixtures.surfaces import box, joined, torus


def crosses(first: np.ndarray, second: np.ndarray) -> bool:
    """Whether an edge of one (3, 3) triangle meets the inside of the other, by solving for it."""
    for one, other in ((first, second), (second, first)):
        for corner in range(3):
            p, q = one[corner], one[(corner + 1) % 3]
            matrix = np.stack([p - q, other[1] - other[0], other[2] - other[0]], axis=1)
            if abs(np.linalg.det(matrix)) > 1e-12:
                t, u, v = np.linalg.solve(matrix, p - other[0])
                if 0 < t < 1 and u >= 0 and v >= 0 and u + v <= 1:
                    return True
    return False


@pytest.mark.parametrize("mesh", [box(), torus(), box((5, 5, 5), (5.1, 6, 9))])
def test_clean_parts_have_none(mesh):
    assert len(self_intersections(mesh)) == 0


def test_boxes_that_touch_do_not_cross():
    assert len(self_intersections(joined(box(), box((1, 0, 0), (2, 1, 1))))) == 0


def test_agrees_with_every_pair_tested(seed=1):
    rng = np.random.default_rng(seed)
    vertices = rng.random((90, 3))
    mesh = TriMesh(vertices, np.arange(90).reshape(-1, 3))
    triangles = vertices[mesh.faces]
    expected = [
        (i, j) for i in range(30) for j in range(i + 1, 30) if crosses(triangles[i], triangles[j])
    ]
    assert len(expected) > 20
    assert self_intersections(mesh).tolist() == [list(pair) for pair in expected]


def test_fold_at_a_common_vertex_is_found():
    vertices = [[0, 0, 0], [2, -1, 0], [2, 1, 0], [1, 0, -1], [1, 0, 1]]
    assert self_intersections(TriMesh(vertices, [[0, 1, 2], [0, 3, 4]])).tolist() == [[0, 1]]


def test_any_size_and_placement():
    two = joined(torus(), box((1.5, -0.2, -0.2), (9, 0.3, 0.2)))
    pairs = self_intersections(two)
    assert len(pairs) > 0
    for scale, shift in ((1e-12, 0.0), (1e30, 0.0), (1.0, 1e4)):
        moved = TriMesh(two.vertices * scale + shift, two.faces)
        assert (self_intersections(moved) == pairs).all()


def test_places_are_separate_and_the_largest_comes_first():
    """A bar through a block leaves it on two sides, a small one cuts a corner elsewhere."""
    block, bar = box((0, 0, 0), (4, 4, 4)), box((1, 1, -1), (2, 2, 5))
    both = joined(block, bar)
    middles, count = crossing_places(both, self_intersections(both))
    assert len(middles) == 1  # the faces of a block have common corners: one place
    far = joined(both, box((20.0, 0, 0), (21, 1, 1)), box((20.9, 0.9, 0.9), (22, 2, 2)))
    pairs = self_intersections(far)
    middles, count = crossing_places(far, pairs)
    assert len(middles) == 2 and count.sum() == len(pairs) and count[0] >= count[1]
    assert sorted(middles[:, 0] > 10) == [False, True]


def test_two_folds_far_apart_are_two_places():
    fold = TriMesh(
        [[0, 0, 0], [2, -1, 0], [2, 1, 0], [1, 0, -1], [1, 0, 1]], [[0, 1, 2], [0, 3, 4]]
    )
    two = joined(fold, TriMesh(fold.vertices + 10, fold.faces))
    middles, count = crossing_places(two, self_intersections(two))
    assert count.tolist() == [1, 1]
    own = fold.vertices[fold.faces].mean(axis=1)
    assert min(np.abs(own - middles[0]).max(axis=1)) < 1e-12
    assert min(np.abs(own + 10 - middles[1]).max(axis=1)) < 1e-12


def test_too_many_long_faces_are_not_compared():
    """Each of the random triangles overlaps most others; memory is bounded as well."""

    def soup_of(n: int) -> TriMesh:
        corners = np.random.default_rng(0).random((3 * n, 3))
        return TriMesh(corners, np.arange(3 * n).reshape(-1, 3))

    assert len(self_intersections(soup_of(200))) > 1000
    soup = soup_of(15_000)
    sentence = "intersecting faces were not searched for: too many of the 15000 faces lie close"
    with pytest.raises(InputError, match=sentence):
        self_intersections(soup)
    assert [sentence in each for each in crossings(soup)] == [True]
    assert len(self_intersections(torus())) == 0
