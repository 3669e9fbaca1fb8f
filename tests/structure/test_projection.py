"""Closest boundary points of simple polycubes."""

import numpy as np
import pytest

from polycube.structure.lattice import collapse, lattice
from polycube.structure.projection import TRUST, project
from polycube.types import Polycube


def test_points_around_and_inside_a_cube() -> None:
    cube = lattice((1, 1, 1), ("cube",), {"cube": np.ones((3, 3, 3), bool)})
    points = np.array([[2, 0.5, 0.5], [0.5, 0.5, 0.1], [-1, -1, 0.5], [0.4, 0.9, 0.6]])
    nearest, axis = project(cube, points)
    expected = [[1, 0.5, 0.5], [0.5, 0.5, 0], [0, 0, 0.5], [0.4, 1, 0.6]]
    assert nearest == pytest.approx(np.array(expected))
    assert axis[[0, 1, 3]].tolist() == [0, 5, 2]


def test_points_in_a_hole_go_to_its_walls() -> None:
    voxels = np.ones((3, 3, 3), bool)
    voxels[1, 1] = False
    nearest, axis = project(lattice((1, 1, 1), ("h",), {"h": voxels}), np.array([[0.45, 0.5, 0.8]]))
    assert nearest == pytest.approx(np.array([[1 / 3, 0.5, 0.8]]))
    assert axis.tolist() == [0]  # the wall at x = 1/3 looks along +x, into the hole


def two_cells() -> Polycube:
    """A solid cube, and one with a hole along z."""
    hole = np.ones((3, 3, 3), bool)
    hole[1, 1] = False
    return lattice((2, 1, 1), ("c", "h"), {"c": np.ones((3, 3, 3), bool), "h": hole})


def certain(axis: int, cell: int, wall: int, n: int = 1) -> list[np.ndarray]:
    """Log-probabilities of labels that are known up to one in a million."""
    return [
        np.where(np.arange(size) == label, 0.0, -14.0)[None].repeat(n, axis=0)
        for size, label in ((6, axis), (2, cell), (2, wall))
    ]


def test_uniform_label_probabilities_have_no_effect() -> None:
    points = np.random.default_rng(0).uniform(-0.5, 2.5, (200, 3))
    uniform = [np.full((200, size), -np.log(size)) for size in (6, 2, 2)]
    for plain, labelled in zip(
        project(two_cells(), points), project(two_cells(), points, uniform), strict=True
    ):
        assert (plain == labelled).all()


@pytest.mark.parametrize(
    ("labels", "expected"),
    [
        ((0, 1, 0), [2, 0.45, 0.9]),  # outer wall at the end of the grid
        ((2, 1, 0), [1.6, 1, 0.9]),
        ((4, 1, 0), [5 / 3, 0.45, 1]),  # beside the hole, as near as it gets
        ((4, 0, 0), [1, 0.45, 1]),  # the same wall of the other cell
        ((1, 1, 1), [5 / 3, 0.45, 0.9]),  # the hole's wall that looks along -x
        ((2, 1, 1), [1.6, 1 / 3, 0.9]),
    ],
)
def test_labels_determine_the_wall_of_a_point_in_a_hole(
    labels: tuple[int, int, int], expected: list[float]
) -> None:
    point = np.array([[1.6, 0.45, 0.9]])
    placed, axis = project(two_cells(), point, certain(*labels))
    assert placed == pytest.approx(np.array([expected]))
    assert axis.tolist() == [labels[0]]


def test_labels_and_distance_are_balanced() -> None:
    """A face that is e^2 times as probable may be 2 TRUST cells farther away, and no more."""
    cube = lattice((1, 1, 1), ("c",), {"c": np.ones((3, 3, 3), bool)})
    favours_x = np.array([[0, -8, -2, -8, -8, -8]], float)
    for gap, axis in ((1.9 * TRUST, 0), (2.1 * TRUST, 2)):
        point = np.array([[0.9 - gap, 0.9, 0.5]])  # nearer to the face that looks along +y
        known = [favours_x, np.zeros((1, 1)), np.zeros((1, 2))]
        assert project(cube, point, known)[1].tolist() == [axis]


@pytest.mark.parametrize("context", [("c", "c"), ("hz", "hx"), (None, "c")])
def test_labels_need_the_faces_of_single_cells(context: tuple[str | None, str]) -> None:
    hole_z, hole_x = np.ones((2, 3, 3, 3), bool)
    hole_z[1, 1], hole_x[:, 1, 1] = False, False
    voxels = {"c": np.ones((3, 3, 3), bool), "hz": hole_z, "hx": hole_x}
    collapsed = collapse(lattice((2, 1, 1), context, voxels))
    with pytest.raises(ValueError, match="cells of a collapsed polycube are not known"):
        project(collapsed, np.zeros((1, 3)), certain(0, 0, 0))
