"""Measurements of meshes with known faults that are small relative to the diagonal."""

import numpy as np
import pytest

from polycube.fitting.snapping import exceeded_limits
from polycube.hexmesh import quality
from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.crossings import crossings
from polycube.hexmesh.inspection import Inspection, inspect
from tests.fixtures.hexmeshes import hex_beam, surface_of, unit_cubes
from tests.fixtures.surfaces import box as surface_box
from tests.fixtures.surfaces import joined


def test_a_mesh_that_matches_its_surface():
    found = inspect(hex_mesh(*unit_cubes(2, 2, 2)), surface_box((0, 0, 0), (2, 2, 2)))
    assert found.scaled_jacobian == 1
    assert len(found.crossings) == 0
    assert found.deviation.to_surface.largest == pytest.approx(0, abs=1e-12)
    assert found.deviation.to_mesh.largest == pytest.approx(0, abs=1e-12)
    assert found.creases == pytest.approx(0, abs=1e-12)
    assert found.volume_ratio == pytest.approx(1)
    assert found.off_wall.share == pytest.approx(0, abs=1e-12)
    assert found.off_size.share == pytest.approx(0, abs=1e-12)
    assert found.lost_faces == ()


def test_distance_of_a_moved_mesh():
    """The cube of edge 2 moved by 0.1: mesh edges of 1 along the face, a wall of 2."""
    vertices, cubes = unit_cubes(2, 2, 2)
    mesh = hex_mesh(vertices + np.array([0.1, 0, 0]), cubes)
    found = inspect(mesh, surface_box((0, 0, 0), (2, 2, 2)))
    on_mesh, on_surface = found.farthest
    assert on_mesh[0] == pytest.approx(2.1) and on_surface[0] == pytest.approx(0)
    for local, length in ((found.off_size, 1.0), (found.off_wall, 2.0)):
        assert local.distance == pytest.approx(0.1)
        assert local.length == pytest.approx(length)
        assert local.share == pytest.approx(0.1 / length)
        assert local.place[0] == pytest.approx(0) or local.place[0] == pytest.approx(2.1)


def test_a_missing_ligament_is_large_relative_to_wall_and_edges():
    """1.6 % of the diagonal and 0.6 % of the volume: no limit by the diagonal is exceeded."""
    part = surface_of(hex_beam())
    assert inspect(hex_beam(), part).off_wall.share == pytest.approx(0, abs=1e-9)
    found = inspect(hex_beam(cut=True), part)
    assert exceeded_limits(found) == 0
    for local in (found.off_wall, found.off_size):
        assert local.distance == pytest.approx(1, abs=0.05)
        assert local.length == pytest.approx(1)
        x, y, z = local.place
        assert x == pytest.approx(30, abs=0.1) and 0 <= y <= 1 and 10 <= z <= 12
    assert found.deviation.to_mesh.largest > 5 * found.deviation.to_mesh.p99


def test_a_fold_of_the_surface_is_no_wall():
    """A small fold in a face of the block: there is almost no solid between its sides."""
    block, speck = (
        surface_box((0, 0, 0), (2, 2, 2)),
        surface_box((1, 1, 1.9995), (1.001, 1.001, 2.0005)),
    )
    vertices, cubes = unit_cubes(2, 2, 2)
    found = inspect(hex_mesh(vertices - [0, 0, 0.2], cubes), joined(block, speck))
    assert found.off_wall.share == pytest.approx(0.1, abs=0.01)


def test_cad_faces_without_a_quad_are_named():
    """A block whose boss is missing: its top has a name of its own, its sides share theirs."""
    around = tuple((x, y, 1) for x in range(5) for y in range(5) if (x, y) != (2, 2))
    with_boss = hex_mesh(*unit_cubes(5, 5, 2, missing=around))
    plain = hex_mesh(*unit_cubes(5, 5, 1))
    middle = with_boss.vertices[with_boss.quads].mean(axis=1)
    region = np.where(middle[:, 2] > 1, 2, 1)
    region[(middle[:, 2] == 1.5) & (middle[:, 0] != 2.5)] = 3
    region[middle[:, 2] == 2] = 4
    part = surface_of(with_boss, region, ("BASE", "SIDE", "SIDE", "TIP"))
    assert inspect(with_boss, part).lost_faces == ()
    found = inspect(plain, part)
    assert found.lost_faces == ("cad_face_2", "cad_face_3", "TIP")
    widths = list(found.faces_without_quads.values())  # unit squares: 2 area / border
    np.testing.assert_allclose(widths, 0.5 / np.linalg.norm([5, 5, 2]))


def test_measurements_are_lazy_and_cached():
    mesh, surface = hex_mesh(*unit_cubes(2, 2, 2)), surface_box((0, 0, 0), (2, 2, 2))
    found = inspect(mesh, surface)
    assert isinstance(found, Inspection) and inspect(mesh, surface) is found
    assert found.crossings is found.crossings
    assert np.array_equal(found.crossings, crossings(mesh))
    measured = set(vars(found)) - {"mesh", "surface"}
    assert measured == {"crossings"}
    assert found.deviation == quality.deviation(mesh, surface)
