"""Scaled Jacobian compared with known values and VTK; exact distances and volumes."""

import csv

import numpy as np
import pytest
import trimesh

from polycube.hexmesh import quality
from polycube.hexmesh.connectivity import CORNERS, hex_mesh
from polycube.hexmesh.inspection import inspect
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.types import TriMesh
from tests.fixtures.hexmeshes import unit_cubes


def tri(mesh: trimesh.Trimesh) -> TriMesh:
    return TriMesh(mesh.vertices, mesh.faces)


def cube_surface() -> TriMesh:
    """[0, 2]^3"""
    return tri(trimesh.creation.box(bounds=[[0, 0, 0], [2, 2, 2]]))


def test_box_is_perfect_at_any_aspect():
    vertices, cubes = unit_cubes(2, 2, 2)
    assert scaled_jacobian(vertices * [1, 5, 0.1], cubes) == pytest.approx(1)


def test_sheared_cube_has_the_sine_of_its_angle():
    vertices, cube = unit_cubes(1, 1, 1)
    sheared = vertices + np.outer(vertices[:, 2], [1, 0, 0])
    assert scaled_jacobian(sheared, cube)[0] == pytest.approx(np.sqrt(0.5))


def test_mirrored_cube_and_flat_edge():
    vertices, cube = unit_cubes(1, 1, 1)
    assert scaled_jacobian(vertices * [-1, 1, 1], cube)[0] == -1
    vertices[cube[0, 1]] = vertices[cube[0, 0]]
    assert scaled_jacobian(vertices, cube)[0] == -1


def test_scaled_jacobian_includes_the_centre():
    """All corners are right-handed, but the centre is inverted."""
    rng = np.random.default_rng(0)
    for _ in range(20000):
        p = rng.normal(size=(8, 3))
        frames = p[CORNERS[:, 1:]] - p[CORNERS[:, :1]]
        if (np.linalg.det(frames) > 0).all():
            axes = [p[[1, 2, 5, 6]].sum(0) - p[[0, 3, 4, 7]].sum(0)]
            axes += [p[[2, 3, 6, 7]].sum(0) - p[[0, 1, 4, 5]].sum(0)]
            axes += [p[4:].sum(0) - p[:4].sum(0)]
            unit = [a / np.linalg.norm(a) for a in axes]
            if np.linalg.det(unit) < 0:
                assert scaled_jacobian(p, np.arange(8)[None])[0] <= np.linalg.det(unit) + 1e-12
                return
    pytest.fail("no such hex among the random ones")


def test_equals_vtk_on_random_hexes():
    pyvista = pytest.importorskip("pyvista")
    rng = np.random.default_rng(1)
    vertices, cubes = unit_cubes(4, 4, 4)
    vertices = vertices + 0.25 * rng.normal(size=vertices.shape)
    cells = np.column_stack([np.full(len(cubes), 8), cubes]).ravel()
    grid = pyvista.UnstructuredGrid(cells, np.full(len(cubes), 12), vertices)
    wanted = grid.cell_quality("scaled_jacobian").cell_data["scaled_jacobian"]
    assert scaled_jacobian(vertices, cubes) == pytest.approx(wanted, abs=1e-12)


def test_equals_the_published_numbers(testdata):
    pyvista = pytest.importorskip("pyvista")
    folder = testdata / "surfaces" / "ref_hex"
    for row in csv.DictReader((folder / "README.csv").open()):
        grid = pyvista.read(folder / row["file"])
        found = scaled_jacobian(np.array(grid.points), grid.cells_dict[12])
        assert len(found) == int(row["hexes"])
        assert found.min() == pytest.approx(float(row["min_sj"]), abs=2e-6)
        assert found.mean() == pytest.approx(float(row["mean_sj"]), abs=2e-6)


def test_volume_of_a_box_far_away_and_of_a_bilinear_one():
    vertices, cubes = unit_cubes(2, 2, 2)
    assert quality.volume(hex_mesh(vertices + 1e6, cubes)) == pytest.approx(8, rel=1e-9)
    vertices, cube = unit_cubes(1, 1, 1)
    vertices[cube[0, 6]] += [0, 0, 1]  # height 1 + u v: integral 1 + 1/4
    assert quality.volume(hex_mesh(vertices, cube)) == pytest.approx(1.25)


def test_a_mesh_of_the_cube_has_no_deviation():
    mesh = hex_mesh(*unit_cubes(2, 2, 2))
    found = quality.deviation(mesh, cube_surface())
    assert found.vertices == pytest.approx(0, abs=1e-12)
    assert found.to_surface.largest == pytest.approx(0, abs=1e-12)
    assert found.to_mesh.largest == pytest.approx(0, abs=1e-12)


def test_deviation_of_a_moved_mesh_is_its_displacement():
    vertices, cubes = unit_cubes(2, 2, 2)
    mesh = hex_mesh(vertices + np.array([0.1, 0, 0]), cubes)
    found = quality.deviation(mesh, cube_surface())
    moved = 0.1 / np.sqrt(12)  # of the diagonal
    assert found.vertices == pytest.approx(moved)
    assert found.to_surface.largest == pytest.approx(moved)
    assert found.to_mesh.largest == pytest.approx(moved)
    assert found.to_surface.mean < moved
    assert found.to_surface.p99 <= found.to_surface.largest


def test_creases_of_the_cube_are_on_edges_until_the_mesh_turns():
    vertices, cubes = unit_cubes(2, 2, 2)
    solid = cube_surface()
    assert inspect(hex_mesh(vertices, cubes), solid).creases < 1e-12
    lower = hex_mesh(vertices - [0, 0, 0.1], cubes)  # four edges of twelve are 0.1 off all edges
    assert inspect(lower, solid).creases == pytest.approx(0.1 / np.sqrt(12))
    ball = tri(trimesh.creation.icosphere(subdivisions=2))
    assert inspect(lower, ball).creases == 0


def test_deviation_equals_igl_on_a_sphere():
    igl = pytest.importorskip("igl")
    sphere = trimesh.creation.icosphere(subdivisions=2)
    vertices, cubes = unit_cubes(2, 2, 2)
    mesh = hex_mesh((vertices - 1) * 0.6, cubes)
    inside = np.einsum("sk,qkd->qsd", quality.SHARES, mesh.vertices[mesh.quads]).reshape(-1, 3)
    square = igl.point_mesh_squared_distance(
        np.ascontiguousarray(inside), np.array(sphere.vertices), np.array(sphere.faces)
    )[0]
    wanted = np.sqrt(square.max()) / np.linalg.norm(np.ptp(sphere.vertices, axis=0))
    assert quality.deviation(mesh, tri(sphere)).to_surface.largest == pytest.approx(
        wanted, rel=1e-9
    )
