"""Numbers of a hex mesh in `report.json`: exact where the mesh is simple, plain JSON always."""

import json

import numpy as np
import pytest

from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.io.hex_meshes import boundary
from polycube.io.vtk import write_hex_vtu
from polycube.report.numbers import quality
from polycube.types import HexMesh
from tests.fixtures.hexmeshes import hex_box
from tests.fixtures.surfaces import box


def moved(mesh: HexMesh, vertex: int, by) -> HexMesh:
    vertices = mesh.vertices.copy()
    vertices[vertex] += by
    return HexMesh(vertices, mesh.hexes, mesh.quads, mesh.patch, mesh.cell)


def inner(mesh: HexMesh) -> np.ndarray:
    return np.setdiff1d(np.arange(len(mesh.vertices)), mesh.quads)


def test_a_box_on_its_box_is_perfect() -> None:
    mesh = hex_box((2, 3, 4), (2.0, 3.0, 4.0))
    report = quality.full(mesh, box(high=(2.0, 3.0, 4.0)), ("cube",))
    assert report == json.loads(json.dumps(report))
    assert report["volume"] == pytest.approx(24) and report["volume_error"] < 1e-12
    for name, numbers in report["quality"].items():
        expected = 0 if name == "skew" else 1
        assert [numbers[k] for k in ("min", "mean", "max")] == pytest.approx([expected] * 3)
    assert report["certificate"] == {
        "positive_at_corners": True,
        "positive_everywhere": True,
        "not_positive": 0,
        "undecided": 0,
        "not_certified": [],
        "least_bound": pytest.approx(1),
        "least_bound_hex": report["certificate"]["least_bound_hex"],
    }
    assert report["deviation"]["surface_to_mesh_max"] < 1e-12
    assert report["creases_to_edges_p95"] < 1e-12
    assert report["deviation"]["diagonal"] == pytest.approx(np.sqrt(29))


def test_deviation_in_model_units_is_the_fraction_times_the_diagonal() -> None:
    mesh, surface = hex_box((2, 2, 2)), box((-0.01, 0, 0), (1.0, 1, 1))
    report = quality.full(mesh, surface)
    lengths = report["deviation"]
    assert lengths["surface_to_mesh_max"] == pytest.approx(0.01)
    assert lengths["vertex_off_surface_max"] == pytest.approx(0.01)
    assert lengths["creases_to_edges_p95"] == pytest.approx(0.01)  # 4 edges of 12
    for name, value in lengths.items():
        if name in report:
            assert value == pytest.approx(report[name] * lengths["diagonal"])
    assert lengths["surface_to_mesh_max_at"][0] == pytest.approx(-0.01)
    assert lengths["mesh_to_surface_max_at"][0] == pytest.approx(0)
    away = quality.quad_deviation(mesh, surface)
    low = (mesh.vertices[mesh.quads][:, :, 0] == 0).all(axis=1)
    assert away[low] == pytest.approx(0.01) and away.max() == pytest.approx(0.01)
    far_side = (mesh.vertices[mesh.quads][:, :, 0] == 1).all(axis=1)
    assert away[far_side] == pytest.approx(0, abs=1e-12)
    off = quality.off_surface(mesh, surface)
    inside = (mesh.vertices[:, 0] == 0) & (mesh.vertices[:, 1:] == 0.5).all(axis=1)
    assert off[inside] == pytest.approx(0.01) and off.max() == pytest.approx(0.01)
    assert (off[inner(mesh)] == 0).all()


def test_the_worst_hex_is_found_with_its_place_cell_and_patches() -> None:
    mesh = hex_box((3, 3, 3))
    mesh = hex_mesh(mesh.vertices, mesh.hexes, mesh.quads, np.arange(54), np.arange(27) % 2)
    corner = int(np.flatnonzero((mesh.vertices == 0).all(axis=1))[0])
    bad = moved(mesh, corner, [0.2, 0.2, 0.2])
    [owner] = np.flatnonzero((mesh.hexes == corner).any(axis=1))
    rows = quality.worst_hexes(bad, ("cube", "hole_z"))
    first = rows[0]
    assert first["hex"] == owner and first["worst_by"] == "scaled_jacobian"
    assert first["scaled_jacobian"] == pytest.approx(scaled_jacobian(bad.vertices, bad.hexes).min())
    assert first["center"] == pytest.approx(bad.vertices[bad.hexes[owner]].mean(axis=0).tolist())
    assert first["primitive"] == ("cube", "hole_z")[owner % 2] and first["cell"] == owner % 2
    on = (mesh.quads == corner).any(axis=1)
    assert first["patches"] == mesh.patch[on].tolist() and on.sum() == 3
    assert [row["scaled_jacobian"] for row in rows[:5]] == sorted(
        row["scaled_jacobian"] for row in rows[:5]
    )
    assert [row["worst_by"] for row in rows[5:]] == ["edge_ratio", "skew", "condition"]
    inside = quality.worst_hexes(moved(mesh, inner(mesh)[0], 0.2))
    assert "primitive" not in inside[0]


def test_histograms_count_every_hex_and_take_what_lies_beyond() -> None:
    values = np.array([0.05, 0.5, 0.99, 1.0])
    for name in ("scaled_jacobian", "skew", "shape"):
        found = quality.histogram(name, values)
        assert sum(found["counts"]) == 4 and len(found["edges"]) == len(found["counts"]) + 1
        assert (found["edges"][0], found["edges"][-1]) == (0, 1) and found["counts"][-1] == 2
    far = quality.histogram("edge_ratio", np.array([1.0, 1e30]))
    assert far["counts"][0] == far["counts"][-1] == 1
    assert quality.histogram("scaled_jacobian", np.array([-0.2]))["edges"][0] == -1


def test_a_hex_that_only_its_corners_pass_is_named_in_the_certificate() -> None:
    corners = [[1, 0, 2], [2, -2, -2], [3, 2, -1], [2, 2, -1], [2, 1, 6], [5, 0, 5], [5, 4, 4]]
    mesh = hex_mesh(np.array([*corners, [-2, 3, 2]], float), np.arange(8)[None])
    found = quality.full(mesh, boundary(mesh))["certificate"]
    assert found["positive_at_corners"] and not found["positive_everywhere"]
    assert found["not_positive"] == 1 and found["not_certified"] == [0]
    assert found["least_bound"] < 0


def test_vtk_computes_from_the_file_what_the_file_says(tmp_path) -> None:
    pyvista = pytest.importorskip("pyvista")
    mesh = hex_box((3, 3, 3), (1.0, 2.0, 3.0))
    vertices = mesh.vertices + 0.06 * np.random.default_rng(0).normal(size=mesh.vertices.shape)
    mesh = HexMesh(vertices, mesh.hexes, mesh.quads, mesh.patch, mesh.cell)
    off = quality.off_surface(mesh, box(high=(1.0, 2.0, 3.0)))
    path = write_hex_vtu(tmp_path / "hex.vtu", mesh, ("cube",), {"off_surface": off})
    grid = pyvista.read(path)
    np.testing.assert_array_equal(grid.point_data["off_surface"], off)
    for name in ("scaled_jacobian", "max_edge_ratio", "skew", "condition", "shape"):
        theirs = grid.cell_quality([name]).cell_data[name]
        np.testing.assert_allclose(grid.cell_data[name], theirs, 1e-9, 1e-12)
    assert {"edge_ratio", "cell", "primitive"} <= set(grid.cell_data)


def test_a_warning_names_the_place_and_the_reason_of_a_small_det_j() -> None:
    distances = {f"{way}_p99": 0.001 for way in quality.WAYS}
    least = {"min_scaled_detj_at": [1.0, 2.5, -3.0], "min_scaled_detj_hex": 0.61}
    numbers = {"is_positive": True, **distances, **least, "min_scaled_detj_edges": 4}
    assert quality.spline_warnings({**numbers, "min_scaled_detj": quality.DETJ_LIMIT}) == []
    [found] = quality.spline_warnings({**numbers, "min_scaled_detj": 0.013})
    assert found == (
        "det J of the spline is 0.013 of its mean in the element at (1, 2.5, -3), less than 0.05, "
        "and the fit could not raise it: the hex has a scaled Jacobian of 0.61, and 4 "
        "extraordinary edges meet there"
    )
