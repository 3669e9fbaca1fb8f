"""Measures of single hexes: known solids, values of VTK on random hexes, published meshes."""

import csv

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.hexmesh.connectivity import PLACES
from polycube.hexmesh.metrics import CHUNK, LARGEST, MEASURES, metrics, worst

ROTATED = np.array([0, 4, 5, 1, 3, 7, 6, 2])  # the same hex with zeta, xi, eta as its axes
VTK = {
    "scaled_jacobian": "HexScaledJacobian",
    "max_edge_ratio": "HexMaxEdgeRatio",
    "skew": "HexSkew",
    "condition": "HexCondition",
    "shape": "HexShape",
}
ONE = np.arange(8)[None]


def random_hexes(n: int, amplitude: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    noise = np.random.default_rng(seed).normal(size=(n, 8, 3))
    points = (PLACES + amplitude * noise).reshape(-1, 3) * [1, 2, 5]
    return points, np.arange(8 * n).reshape(-1, 8)


def by_vtk(name: str, points: np.ndarray, hexes: np.ndarray) -> np.ndarray:
    pyvista = pytest.importorskip("pyvista")
    from vtkmodules.vtkFiltersVerdict import vtkMeshQuality

    grid = pyvista.UnstructuredGrid({12: hexes}, points)
    measure = getattr(vtkMeshQuality, name)
    return np.array([measure(grid.GetCell(i)) for i in range(len(hexes))])


def test_a_cube_is_perfect_in_every_measure():
    found = metrics(7.0 * PLACES, ONE)
    assert list(found) == list(MEASURES)
    for name, (perfect, _, _) in MEASURES.items():
        assert found[name] == pytest.approx([perfect], abs=1e-12)


def test_a_box_and_a_sheared_cube_are_exact():
    box = metrics(PLACES * np.array([1.0, 2.0, 5.0]), ONE)
    assert box["edge_ratio"][0] == pytest.approx(5) == box["max_edge_ratio"][0]
    # |A|^2 = 30, |A^-1|^2 = 1 + 1/4 + 1/25; shape 3 (10)^(2/3) / 30
    assert box["condition"][0] == pytest.approx(np.sqrt(30 * 1.29) / 3)
    assert box["shape"][0] == pytest.approx(10 ** (2 / 3) / 10)
    sheared = metrics(PLACES + np.outer(PLACES[:, 2], [1.0, 0, 0]), ONE)
    assert sheared["skew"][0] == pytest.approx(np.sqrt(0.5))
    assert sheared["edge_ratio"][0] == pytest.approx(np.sqrt(2))


def test_inverted_and_collapsed_hexes_are_bounded():
    mirrored = metrics(PLACES * np.array([-1.0, 1, 1]), ONE)
    assert mirrored["condition"][0] == LARGEST and mirrored["shape"][0] == 0
    points = PLACES.astype(float)
    points[1] = points[0]
    collapsed = metrics(points, ONE)
    assert collapsed["edge_ratio"][0] == LARGEST
    assert all(np.isfinite(values).all() for values in collapsed.values())


@pytest.mark.parametrize("amplitude", [0.02, 0.15, 0.8])
def test_equal_to_vtk_on_random_hexes(amplitude):
    points, hexes = random_hexes(400, amplitude)
    found = metrics(points, hexes)
    for name, function in VTK.items():
        np.testing.assert_allclose(found[name], by_vtk(function, points, hexes), 1e-9, 1e-12)


def test_edge_ratio_is_that_of_vtk_for_all_orders_of_edges():
    points, hexes = random_hexes(300, 0.2)
    turned = [hexes, hexes[:, ROTATED], hexes[:, ROTATED][:, ROTATED]]
    ratios = np.max([by_vtk("HexEdgeRatio", points, h) for h in turned], axis=0)
    np.testing.assert_allclose(metrics(points, hexes)["edge_ratio"], ratios, 1e-12)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(1e-3, 1e3))
def test_measures_are_independent_of_size_position_and_rotation(seed, scale):
    points, hexes = random_hexes(5, 0.15, seed)
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    moved = metrics(scale * (points @ turn.T + [3.0, -1, 2]), hexes[:, ROTATED])
    for name, values in metrics(points, hexes).items():
        np.testing.assert_allclose(moved[name], values, 1e-6, 1e-6)


def test_chunks_do_not_change_the_result():
    points, hexes = random_hexes(50, 0.2)
    at_once, times = metrics(points, hexes), CHUNK // 50 + 1
    for name, values in metrics(points, np.tile(hexes, (times, 1))).items():
        np.testing.assert_array_equal(values, np.tile(at_once[name], times))


def test_worst_depends_on_the_direction_of_the_measure():
    values = np.array([0.3, 0.9, 0.1])
    assert worst("scaled_jacobian", values, 2).tolist() == [2, 0]
    assert worst("edge_ratio", values, 2).tolist() == [1, 0]


def test_published_meshes_have_their_published_values(testdata):
    meshio = pytest.importorskip("meshio")
    folder = testdata / "surfaces" / "ref_hex"
    with (folder / "README.csv").open() as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        mesh = meshio.read(folder / row["file"])
        found = metrics(mesh.points, mesh.cells_dict["hexahedron"])
        assert found["scaled_jacobian"].min() == pytest.approx(float(row["pyvista_min"]), abs=2e-6)
        assert found["scaled_jacobian"].mean() == pytest.approx(
            float(row["pyvista_mean"]), abs=2e-6
        )
        some = mesh.cells_dict["hexahedron"][:500]
        for name, function in VTK.items():
            values = by_vtk(function, mesh.points, some)
            np.testing.assert_allclose(found[name][:500], values, 1e-9, 1e-12)
