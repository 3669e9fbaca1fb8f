"""Empty voxels of each unit cell, and its genus."""

import numpy as np
import pytest

from polycube.diffusion.pairs.templates import contexts, template
from polycube.registry import build, names
from polycube.structure.lattice import genus, lattice
from polycube.surface.measures import genus as surface_genus
from polycube.surface.measures import volume
from polycube.types import TriMesh


@pytest.mark.parametrize(
    ("name", "empty"),
    [
        ("cube", []),
        ("hole_x", [[0, 1, 1], [1, 1, 1], [2, 1, 1]]),
        ("hole_y", [[1, 0, 1], [1, 1, 1], [1, 2, 1]]),
        ("hole_z", [[1, 1, 0], [1, 1, 1], [1, 1, 2]]),
        ("blind_px", [[1, 1, 1], [2, 1, 1]]),
        ("blind_nx", [[0, 1, 1], [1, 1, 1]]),
        ("blind_py", [[1, 1, 1], [1, 2, 1]]),
        ("blind_ny", [[1, 0, 1], [1, 1, 1]]),
        ("blind_pz", [[1, 1, 1], [1, 1, 2]]),
        ("blind_nz", [[1, 1, 0], [1, 1, 1]]),
        ("cross_xy", [[0, 1, 1], [1, 0, 1], [1, 1, 1], [1, 2, 1], [2, 1, 1]]),
        ("cross_xz", [[0, 1, 1], [1, 1, 0], [1, 1, 1], [1, 1, 2], [2, 1, 1]]),
        ("cross_yz", [[1, 0, 1], [1, 1, 0], [1, 1, 1], [1, 1, 2], [1, 2, 1]]),
    ],
)
def test_a_hole_runs_along_its_axes(name, empty):
    voxels = build("primitive", {"plugin": name})()
    assert voxels.shape == (3, 3, 3) and voxels.dtype == bool
    np.testing.assert_array_equal(np.argwhere(~voxels), np.reshape(empty, (-1, 3)))


def test_the_four_cells_of_the_paper_exist():
    assert set(names("primitive")) >= {"cube", "hole_x", "hole_y", "hole_z"}


def test_the_frame_of_a_cube_is_its_twelve_edges():
    voxels = build("primitive", {"plugin": "cross_xyz"})()
    middle = (np.argwhere(~voxels) == 1).sum(axis=1)
    assert (~voxels).sum() == 7 and (middle >= 2).all()


@pytest.mark.parametrize(
    ("name", "handles"), [("blind_nx", 0), ("hole_y", 1), ("cross_xz", 3), ("cross_xyz", 5)]
)
def test_genus(name, handles):
    """Genus of the cell and of its template: n openings of holes that meet give n - 1."""
    primitives = {name: build("primitive", {"plugin": name})()}
    assert genus(lattice((1, 1, 1), (name,), primitives)) == handles
    shape = template((1, 1, 1), (name,), primitives)
    surface = TriMesh(shape.vertices, shape.faces)
    assert surface_genus(surface) == handles
    assert volume(surface) == pytest.approx(primitives[name].sum() / 27)
    mouths = 1 if name == "blind_nx" else handles + 1
    outer = shape.wall == 0
    a, b, c = shape.vertices[shape.faces[outer]].transpose(1, 0, 2)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(6 - mouths / 9)


def test_a_blind_hole_must_open_outwards():
    use = ("cube", "blind_px", "blind_nx", "cross_xy")
    found = contexts((2, 1, 1), {name: build("primitive", {"plugin": name})() for name in use})
    assert ("blind_nx", "cube") in found
    assert ("blind_px", "cube") not in found  # a void
    assert ("blind_px", "cross_xy") in found  # a hole of the neighbour leads into it
