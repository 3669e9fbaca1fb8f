"""The box tree against brute force."""

import numpy as np
import pytest

from polycube.surface import closest


def slow(corners, normals, points, facing, alpha, free) -> np.ndarray:
    """Least value over all triangles, sampled densely with exact edges and corners."""
    t = np.linspace(0, 1, 101)
    u, v = np.meshgrid(t, t)
    inside = u + v <= 1 + 1e-12
    weight = np.stack([1 - u - v, u, v], axis=-1)[inside]
    places = np.einsum("wk,tkd->twd", weight, corners)
    gap = ((points[:, None, None] - places) ** 2).sum(axis=3).min(axis=2)
    turn = ((facing[:, None] - normals) ** 2).sum(axis=2)
    return (gap + alpha**2 * np.maximum(turn - free, 0)).min(axis=1)


@pytest.mark.parametrize(("alpha", "free"), [(0.0, 0.0), (0.2, 0.0), (3.0, 0.0), (0.2, 2.0)])
def test_value_is_the_least(alpha, free):
    rng = np.random.default_rng(0)
    corners = rng.normal(size=(40, 1, 3)) + 0.3 * rng.normal(size=(40, 3, 3))
    normals, points, facing = (rng.normal(size=(n, 3)) for n in (40, 25, 25))
    tree = closest.tree(corners, normals)
    foot, face, weight = closest.closest(tree, points, facing, alpha, free=free)
    assert foot == pytest.approx(np.einsum("nk,nkd->nd", weight, corners[face]))
    assert (weight > -1e-12).all() and weight.sum(axis=1) == pytest.approx(1)
    turn = alpha**2 * np.maximum(((facing - normals[face]) ** 2).sum(axis=1) - free, 0)
    value = ((points - foot) ** 2).sum(axis=1) + turn
    wanted = slow(corners, normals, points, facing, alpha, free)
    assert (value <= wanted + 1e-12).all()
    assert value == pytest.approx(wanted, abs=1e-3)


def test_a_guess_changes_nothing():
    rng = np.random.default_rng(1)
    corners, points = rng.normal(size=(60, 3, 3)), rng.normal(size=(30, 3))
    tree = closest.tree(corners, np.zeros((60, 3)))
    plain = closest.closest(tree, points)
    alone = np.vstack([closest.closest(tree, point[None])[0] for point in points])
    assert alone == pytest.approx(plain[0])
    for _ in range(3):
        guessed = closest.closest(tree, points, guess=rng.integers(0, 60, 30))
        assert guessed[0] == pytest.approx(plain[0])


def test_alpha_prefers_the_side_that_faces_along():
    """Two sheets of a thin wall: the point is nearer to the wrong one."""
    sheet = np.array([[-9.0, -9, 0], [9, -9, 0], [0, 9, 0]])
    corners = np.stack([sheet, sheet + np.array([0, 0, 0.1])])
    tree = closest.tree(corners, np.array([[0.0, 0, -1], [0, 0, 1]]))
    point, up = np.array([[0.0, 0, 0.02]]), np.array([[0.0, 0, 1]])
    assert closest.closest(tree, point, up)[1] == [0]
    assert closest.closest(tree, point, up, alpha=0.2)[1] == [1]


def test_a_point_that_suits_its_sheet_stays_there():
    """A floor and a wall: the point is on the floor, its normal turned 50 degrees to the wall."""
    floor = np.array([[0.0, -9, 0], [9, -9, 0], [0, 9, 0]])
    tree = closest.tree(np.stack([floor, floor[:, [2, 1, 0]]]), np.eye(3)[[2, 0]])
    point, turned = np.array([[0.1, 0, 0]]), np.deg2rad([[50.0]])
    normal = np.hstack([np.sin(turned), 0 * turned, np.cos(turned)])
    assert closest.closest(tree, point, normal, 0.5)[1] == [1]
    foot, face, _ = closest.closest(tree, point, normal, 0.5, free=1.0)
    assert face == [0] and foot == pytest.approx(point)


def test_segments_and_points_as_flat_triangles():
    a, b = np.zeros(3), np.array([2.0, 0, 0])
    tree = closest.tree(np.array([[a, b, b]]), np.zeros((1, 3)))
    points = np.array([[-1.0, 1, 0], [0.5, 1, 0], [3, 0, 0]])
    assert closest.closest(tree, points)[0] == pytest.approx(
        np.array([[0, 0, 0], [0.5, 0, 0], [2, 0, 0]])
    )
    assert closest.distance(tree, points) == pytest.approx([np.sqrt(2), 1, 1])
    dot = closest.tree(np.array([[b, b, b]]), np.zeros((1, 3)))
    assert closest.distance(dot, points) == pytest.approx([np.sqrt(10), np.sqrt(3.25), 1])


def grouped(corners, normals, group, wanted, points, facing, alpha) -> np.ndarray:
    """(N, 3) closest points, by one tree for each group."""
    feet = np.empty_like(points)
    for number in np.unique(wanted):
        own = (group == number) | (number == 0) | (number not in group)
        here = wanted == number
        tree = closest.tree(corners[own], normals[own])
        feet[here] = closest.closest(tree, points[here], facing[here], alpha)[0]
    return feet


@pytest.mark.parametrize("alpha", [0.0, 0.2])
def test_a_tree_with_groups_looks_in_the_group_of_each_point(alpha):
    rng = np.random.default_rng(2)
    corners, points = rng.normal(size=(90, 3, 3)), rng.normal(size=(200, 3))
    normals, facing = rng.normal(size=(90, 3)), rng.normal(size=(200, 3))
    group, wanted = np.array([0, 1, 2, 4])[rng.integers(0, 4, 90)], rng.integers(0, 5, 200)
    trees = closest.tree(corners, normals, group)
    guess = rng.integers(0, 90, 200)  # in other groups too
    # then elsewhere, in the trees of the places before
    for places in (corners, corners[::-1] + 0.3 * rng.normal(size=(90, 3, 3))):
        trees = closest.moved(trees, places, normals)
        found, face, _ = closest.closest(trees, points, facing, alpha, guess, group=wanted)
        expected = grouped(places, normals, group, wanted, points, facing, alpha)
        assert found == pytest.approx(expected)
        has_own = np.isin(wanted, [1, 2, 4])
        assert (group[face] == wanted)[has_own].all()


def test_a_moved_tree_is_that_of_the_new_places():
    rng = np.random.default_rng(3)
    corners, normals = rng.normal(size=(50, 3, 3)), rng.normal(size=(50, 3))
    far = corners + np.array([5.0, 0, 0])
    trees = closest.moved(closest.tree(corners, normals, np.ones(50, int)), far, normals)
    rebuilt = closest.tree(far, normals, np.ones(50, int))
    for one, other in zip(trees, rebuilt, strict=True):
        assert one == pytest.approx(other)
