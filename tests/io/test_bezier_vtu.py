import csv

import meshio
import numpy as np
import pytest
import pyvista
from vtkmodules.vtkCommonCore import reference
from vtkmodules.vtkCommonDataModel import vtkHigherOrderHexahedron

from polycube.analysis.recovery import EVEN, samples
from polycube.io.bezier import (
    vtk_order,
    write_bezier_vtu,
    write_field_vtu,
    write_modes_csv,
    write_solution,
)
from polycube.spline.bernstein import bernstein, tensor
from polycube.spline.bezier import bezier_points
from polycube.spline.spaces.extraction import volumetric_spline
from polycube.spline.spaces.sharp_features import single_hex_edges
from polycube.types import Modes
from tests.fixtures.hexmeshes import hex_ball, hex_cylinder


@pytest.fixture(scope="module")
def spline():
    mesh = hex_cylinder(2, 2, 2)
    return volumetric_spline(mesh, single_hex_edges(mesh))


@pytest.fixture
def modes(spline):
    shapes = np.random.default_rng(0).standard_normal((8, len(spline.control), 3))
    values = np.array([-1e-9, 0, 0, 0, 0, 1e-9, 4e4, 9e6]) * np.pi**2
    return Modes(values, shapes, 1.5, {"frequency": "Hz"})


def test_order_is_vtk_s():
    for place in range(64):
        i, j, k = place % 4, place // 4 % 4, place // 16
        number = vtkHigherOrderHexahedron.PointIndexFromIJK(i, j, k, [3, 3, 3, 64])
        assert vtk_order()[number] == place


@pytest.mark.parametrize("element", [0, 7, 20])
def test_vtk_evaluates_the_same_solid(spline, element, tmp_path):
    numbers = {"scaled_det_j": np.arange(len(spline.nodes)) / 3}
    path = write_bezier_vtu(tmp_path / "spline.vtu", spline, cell_data=numbers)
    grid = pyvista.read(path)
    assert np.array_equal(grid.cell_data["scaled_det_j"], numbers["scaled_det_j"])
    assert (grid.celltypes == 79).all()
    assert np.array_equal(grid.cell_data["hex"], spline.element_hex)
    cell = grid.GetCell(element)
    for place in ([0.0, 0.0, 0.0], [0.2, 0.7, 0.4], [1.0, 0.3, 0.9]):
        found = [0.0, 0.0, 0.0]
        cell.EvaluateLocation(reference(0), place, found, [0.0] * 64)
        basis = tensor(*bernstein(np.array(place))[:, None])
        assert found == pytest.approx(basis[0] @ bezier_points(spline)[element], abs=1e-12)


@pytest.mark.parametrize("element", [0, 7, 20])
def test_curved_cells_are_the_elements_with_the_values_of_the_fields(spline, element, tmp_path):
    """VTK evaluates the same solid and the same tricubic field, also where cells are curved."""
    square = spline.extraction @ spline.control[:, 1] ** 2  # Bezier coefficients
    path = write_field_vtu(tmp_path / "fields.vtu", spline, {"square": square})
    grid = pyvista.read(path)
    assert (grid.celltypes == 72).all() and np.array_equal(
        grid.cell_data["hex"], spline.element_hex
    )
    cell, weights = grid.GetCell(element), [0.0] * 64
    numbers = [cell.GetPointId(k) for k in range(64)]
    for place in ([0.0, 0.0, 0.0], [0.2, 0.7, 0.4], [1.0, 0.3, 0.9], [0.0, 1.0, 0.4]):
        found = [0.0, 0.0, 0.0]
        cell.EvaluateLocation(reference(0), place, found, weights)
        basis = tensor(*bernstein(np.array(place))[:, None])[0]
        assert found == pytest.approx(basis @ bezier_points(spline)[element], abs=1e-12)
        value = np.array(weights) @ grid.point_data["square"][numbers]
        assert value == pytest.approx(basis @ square[spline.nodes[element]], abs=1e-12)


def test_other_programs_read_the_values_at_the_points(spline, tmp_path):
    """The field is y^2 + z at the points, as the file says; control values would be others."""
    even = samples(spline, spline.extraction @ spline.control)
    nodal = np.zeros(spline.extraction.shape[0])
    nodal[spline.nodes] = (even[..., 1] ** 2 + even[..., 2]) @ np.linalg.inv(EVEN).T
    mesh = meshio.read(write_field_vtu(tmp_path / "fields.vtu", spline, {"f": nodal}))
    assert [block.type for block in mesh.cells] == ["VTK_LAGRANGE_HEXAHEDRON"]
    exact = mesh.points[:, 1] ** 2 + mesh.points[:, 2]
    assert mesh.point_data["f"].ravel() == pytest.approx(exact, abs=1e-12)


def test_corners_are_hexahedra_with_the_values_of_the_fields(spline, tmp_path):
    square = spline.extraction @ spline.control[:, 1] ** 2  # Bezier coefficients
    fields = {"shift": 2 * (spline.extraction @ spline.control), "square": square}
    path = write_field_vtu(tmp_path / "corners.vtu", spline, fields, False, "single")
    grid = pyvista.read(path)
    assert (grid.celltypes == 12).all() and grid.n_cells == len(spline.nodes)
    assert np.array_equal(grid.cell_data["hex"], spline.element_hex)
    corner = tensor(*[bernstein(np.array([0.0, 1.0]))] * 3)  # (8, 64), i fastest
    places = [0, 1, 3, 2, 4, 5, 7, 6]
    for element in (0, 7, 20):
        own = corner[places] @ bezier_points(spline)[element]
        found = grid.get_cell(element)
        assert found.points == pytest.approx(own, abs=1e-15)
        assert grid.point_data["shift"][found.point_ids] == pytest.approx(2 * own, rel=1e-6)
        values = corner[places] @ square[spline.nodes[element]]
        assert grid.point_data["square"][found.point_ids] == pytest.approx(values, rel=1e-6)
    assert grid.point_data["shift"].dtype == np.float32 and grid.points.dtype == np.float64
    other = meshio.read(path)
    assert np.array_equal(other.cells_dict["hexahedron"], grid.cells_dict[12])
    assert np.array_equal(other.point_data["shift"], grid.point_data["shift"])


@pytest.mark.parametrize(("precision", "kind"), [("single", np.float32), ("double", np.float64)])
def test_precision_is_that_of_the_fields_alone(spline, modes, tmp_path, precision, kind):
    write_solution(tmp_path, spline, modes, precision=precision)
    grid = pyvista.read(tmp_path / "modes.vtu")
    assert grid.points.dtype == np.float64
    assert {array.dtype for array in grid.point_data.values()} == {np.dtype(kind)}


def test_mode_shapes_are_named_by_number_and_frequency(spline, modes, tmp_path):
    write_solution(tmp_path, spline, modes)
    grid = pyvista.read(tmp_path / "modes.vtu")
    assert list(grid.point_data) == [f"mode_{k:02d} 0 Hz" for k in range(1, 6)] + [
        "mode_06 1.581e-05 Hz",
        "mode_07 100 Hz",
        "mode_08 1500 Hz",
    ]
    shape = grid.point_data["mode_08 1500 Hz"]
    direction = np.zeros((spline.extraction.shape[0], 3))
    direction[spline.nodes] = samples(spline, spline.extraction @ modes.shapes[7])
    assert shape / direction == pytest.approx(np.full(shape.shape, (shape / direction)[0, 0]))
    diagonal = np.linalg.norm(np.ptp(spline.control, axis=0))
    assert 0.02 * diagonal < np.linalg.norm(shape, axis=1).max() <= 0.1 * diagonal


def test_modes_csv_holds_every_digit(modes, tmp_path):
    with open(write_modes_csv(tmp_path / "modes.csv", modes), newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["mode"]) for row in rows] == list(range(1, 9))
    assert np.array_equal([float(row["omega_squared"]) for row in rows], modes.eigenvalues)
    assert np.array_equal([float(row["frequency_hz"]) for row in rows], modes.frequency)
    assert float(rows[6]["frequency_hz"]) == pytest.approx(100)


def test_file_does_not_depend_on_the_run(tmp_path):
    mesh = hex_ball(1)
    files = [
        write_bezier_vtu(tmp_path / name, volumetric_spline(mesh, np.zeros((0, 2), int)))
        for name in "ab"
    ]
    assert files[0].read_bytes() == files[1].read_bytes()
