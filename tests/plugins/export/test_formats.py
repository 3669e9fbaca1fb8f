"""Each format is read back by the reader of another program: points, node order, named sets."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.registry import build, names
from tests.fixtures.exports import ENDS, export, read

PLUGINS = [(name, {}) for name in names("export")] + [("gmsh", {"version": "2.2"})]


@pytest.mark.parametrize(("name", "options"), PLUGINS)
def test_equal_meshes_give_equal_bytes(name, options, mesh, tmp_path):
    plugin = build("export", {"plugin": name, **options})
    assert plugin(mesh, tmp_path / "a").read_bytes() == plugin(mesh, tmp_path / "b").read_bytes()
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize("name", ["vtk", "abaqus", "gmsh", "medit"])
def test_points_and_node_order_are_preserved(name, mesh, tmp_path):
    path = export(mesh, tmp_path, name)
    assert path.parent == tmp_path and path.stem == "hex"
    found = read(path)
    np.testing.assert_array_equal(found.points, mesh.vertices)
    np.testing.assert_array_equal(found.cells_dict["hexahedron"], mesh.hexes)


def test_a_mesh_without_names_gets_those_from_its_geometry(mesh, tmp_path):
    plain = replace(mesh, primitives=(), sets={})
    found = read(export(plain, tmp_path, "abaqus"))
    assert {*ENDS, "hole_1", "patch_0"} <= set(found.point_sets)
    assert set(found.cell_sets) == {"all", "cell_0", "cell_1"}
    for name in set(names("export")) - {"abaqus"}:
        assert export(plain, tmp_path, name).stat().st_size > 0
