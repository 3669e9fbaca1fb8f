import numpy as np
import pytest

from polycube.registry import build, names


@pytest.mark.parametrize(
    ("name", "empty"),
    [
        ("cube", []),
        ("hole_x", [[0, 1, 1], [1, 1, 1], [2, 1, 1]]),
        ("hole_y", [[1, 0, 1], [1, 1, 1], [1, 2, 1]]),
        ("hole_z", [[1, 1, 0], [1, 1, 1], [1, 1, 2]]),
    ],
)
def test_a_hole_runs_along_its_axis(name, empty):
    voxels = build("primitive", {"plugin": name})()
    assert voxels.shape == (3, 3, 3) and voxels.dtype == bool
    np.testing.assert_array_equal(np.argwhere(~voxels), np.reshape(empty, (-1, 3)))


def test_the_four_cells_of_the_paper_are_there():
    assert set(names("primitive")) >= {"cube", "hole_x", "hole_y", "hole_z"}
