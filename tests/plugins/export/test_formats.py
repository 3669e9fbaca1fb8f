"""Each format is read back by the reader of another program: points, node order, named sets."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.registry import build, names, provide
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


@pytest.mark.parametrize("plugin", ["nastran", "lsdyna", "febio"])
@pytest.mark.parametrize(
    ("option", "word"),
    [
        ({"rotation": {"axis": [0, 0, 1], "rpm": 10}}, "rotation"),
        ({"temperature": 20}, "temperature"),
        ({"cyclic": {"sectors": 6}}, "cyclic_symmetry"),
        ({"preloads": [{"point": [0, 0, 0], "axis": [0, 0, 1], "force": 1}]}, "preloads"),
        ({"loads": [{"at": "x_max", "moment": [0, 0, 1]}]}, "varying_loads"),
    ],
)
def test_a_format_refuses_a_problem_that_it_cannot_hold(plugin, option, word) -> None:
    problem = build("analysis", {"plugin": "static", **option}).problem
    if word == "varying_loads" and plugin != "febio":
        assert provide(build("export", {"plugin": plugin}), problem=problem).problem is problem
        return
    with pytest.raises(InputError, match=f"files cannot hold the {word}".replace("_", " ")):
        provide(build("export", {"plugin": plugin}), problem=problem)
    provide(build("export", {"plugin": plugin, "step": False}), problem=problem)
