"""Nearest boundary points of polycubes whose boundary is plain."""

import numpy as np
import pytest

from polycube.geometry.lattice import lattice
from polycube.geometry.projection import project


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
