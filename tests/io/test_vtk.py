"""Files read back by VTK itself: points, cells and data as they were, byte for byte repeatable."""

from pathlib import Path

import numpy as np
import pytest

from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.io import vtk
from polycube.io.atomic import atomic_write
from polycube.io.vtk import write_cells, write_hex_vtu, write_labels_vtp, write_polycube_vtu
from polycube.structure.lattice import lattice
from polycube.types import HexMesh, Labels, TriMesh
from tests.fixtures.hexmeshes import CORNERS


def two_hexes() -> HexMesh:
    vertices = (
        np.concatenate([CORNERS, [[2, 0, 0], [2.5, 1, 0], [2, 0, 1], [2, 1, 1]]]) * 25.4 + 1e3
    )
    hexes = [[0, 1, 2, 3, 4, 5, 6, 7], [1, 8, 9, 2, 5, 10, 11, 6]]
    return hex_mesh(vertices, np.array(hexes), cell=np.array([0, 2]))


def test_hex_vtu_keeps_order_units_and_quality(tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    mesh = two_hexes()
    path = write_hex_vtu(tmp_path / "hex.vtu", mesh, ("hole_z", None, "cube"))
    grid = pyvista.read(path)
    np.testing.assert_array_equal(grid.points, mesh.vertices)
    np.testing.assert_array_equal(grid.cells_dict[pyvista.CellType.HEXAHEDRON], mesh.hexes)
    np.testing.assert_array_equal(grid.cell_data["cell"], mesh.cell)
    assert "<!-- primitive: 0 cube, 1 hole_z -->" in path.read_text()
    np.testing.assert_array_equal(grid.cell_data["primitive"], [1, 0])
    expected = scaled_jacobian(mesh.vertices, mesh.hexes)
    np.testing.assert_array_equal(grid.cell_data["scaled_jacobian"], expected)
    verdict = grid.cell_quality(["scaled_jacobian"]).cell_data["scaled_jacobian"]
    np.testing.assert_allclose(verdict, expected, atol=1e-12)
    assert (grid.compute_cell_sizes().cell_data["Volume"] > 0).all()  # VTK's orientation


def test_hex_vtu_is_read_by_another_program(tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    mesh = two_hexes()
    found = meshio.read(write_hex_vtu(tmp_path / "hex.vtu", mesh, ("cube", "hole_z", "cube")))
    np.testing.assert_array_equal(found.cells_dict["hexahedron"], mesh.hexes)
    np.testing.assert_array_equal(found.points, mesh.vertices)


def test_boundary_vertices_are_flagged(tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    i = np.arange(27).reshape(3, 3, 3)
    corner = np.argwhere(np.ones((2, 2, 2)))
    hexes = i[tuple((corner[:, None] + CORNERS).transpose(2, 0, 1))]
    mesh = hex_mesh(np.argwhere(i >= 0), hexes)
    grid = pyvista.read(write_hex_vtu(tmp_path / "hex.vtu", mesh))
    assert np.flatnonzero(grid.point_data["boundary"] == 0).tolist() == [13]
    assert "primitive" not in grid.cell_data


def test_polycube_vtu_has_one_hexahedron_per_box(tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    hole = np.ones((3, 3, 3), bool)
    hole[1, 1] = False
    primitives = {"cube": np.ones((3, 3, 3), bool), "hole_z": hole}
    polycube = lattice((2, 1, 1), ("hole_z", "cube"), primitives)
    path = write_polycube_vtu(tmp_path / "polycube.vtu", polycube)
    grid = pyvista.read(path)
    assert grid.n_cells == 51
    assert grid.bounds == (0, 2, 0, 1, 0, 1)
    assert grid.volume == pytest.approx(2 - 1 / 9)
    centre = grid.cell_centers().points
    np.testing.assert_array_equal(grid.cell_data["cell"], centre[:, 0] > 1)
    assert "<!-- primitive: 0 cube, 1 hole_z -->" in path.read_text()
    np.testing.assert_array_equal(grid.cell_data["primitive"], centre[:, 0] < 1)


def test_labels_vtp(tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    surface = TriMesh(CORNERS[[0, 1, 3, 4]] * 0.001, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    labels = Labels([5, 3, 0, 1], [7, 8, 9, 10])
    mesh = pyvista.read(write_labels_vtp(tmp_path / "labels.vtp", surface, labels))
    np.testing.assert_array_equal(mesh.regular_faces, surface.faces)
    np.testing.assert_array_equal(mesh.points, surface.vertices)
    np.testing.assert_array_equal(mesh.cell_data["axis"], labels.axis)
    np.testing.assert_array_equal(mesh.cell_data["patch"], labels.patch)


def test_names_with_markup_and_vectors_survive(tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    shift = np.arange(24.0).reshape(8, 3)
    path = tmp_path / "cells.vtu"
    write_cells(
        path, CORNERS, np.arange(8)[None], 12, {'a<b>&"c"': shift}, {"flag": np.array([True])}
    )
    grid = pyvista.read(path)
    np.testing.assert_array_equal(grid.point_data['a<b>&"c"'], shift)
    assert grid.cell_data["flag"].tolist() == [1]


@pytest.mark.parametrize("size", [0, 1, 127, 128, 129, 300])
@pytest.mark.parametrize("bezier", [False, True], ids=["plain", "bezier"])
def test_data_of_any_number_of_blocks_are_read_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, size: int, bezier: bool
) -> None:
    pyvista = pytest.importorskip("pyvista")
    meshio = pytest.importorskip("meshio")
    monkeypatch.setattr(vtk, "BLOCK", 1024)  # 128 numbers
    values = np.random.default_rng(0).standard_normal(size)
    points, vertex = np.stack([values, values, values], 1), 1
    path = vtk._write(
        tmp_path / "a.vtu",
        "UnstructuredGrid",
        f'NumberOfPoints="{size}" NumberOfCells="{size}"',
        {
            "PointData": {"values": values, "single": values.astype(np.float32)},
            "Points": {"points": points},
            "Cells": {
                "connectivity": np.arange(size),
                "offsets": np.arange(1, size + 1),
                "types": np.full(size, vertex, np.uint8),
            },
        },
        version="2.1" if bezier else "1.0",
    )
    grid = pyvista.read(path)
    assert grid.n_points == grid.n_cells == size
    np.testing.assert_array_equal(grid.points, points)
    if size:
        np.testing.assert_array_equal(grid.point_data["values"], values)
        assert grid.point_data["single"].dtype == np.float32
    if size and not bezier:
        found = meshio.read(path)
        np.testing.assert_array_equal(found.points, points)
        np.testing.assert_array_equal(found.point_data["single"].ravel(), values.astype(np.float32))


def test_equal_numbers_take_no_room(tmp_path: Path) -> None:
    cells = np.arange(8)[None]
    sizes = [
        write_cells(tmp_path / "a.vtu", CORNERS, cells, 12, {"u": np.ones((n, 1))}, {})
        .stat()
        .st_size
        for n in (8, 100_000)
    ]
    assert sizes[1] - sizes[0] < 8_000  # of 800,000 bytes


def test_equal_meshes_give_equal_bytes(tmp_path: Path) -> None:
    first = write_hex_vtu(tmp_path / "a.vtu", two_hexes()).read_bytes()
    assert write_hex_vtu(tmp_path / "b.vtu", two_hexes()).read_bytes() == first


def test_a_failed_write_leaves_the_old_file_and_no_other(tmp_path: Path) -> None:
    path = tmp_path / "file.txt"
    path.write_text("old")
    with pytest.raises(RuntimeError, match="half way"), atomic_write(path) as temporary:
        temporary.write_text("new")
        raise RuntimeError("half way")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
    with atomic_write(path) as temporary:
        temporary.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
