"""FEBio, read as XML by the names of its manual."""

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.hexmesh.named_sets import boundary_sets
from polycube.registry import build, provide
from polycube.spline.second_order import hex_elements
from tests.fixtures.exports import corners, export, nodes_of, volume_of
from tests.fixtures.hexmeshes import hex_box


def numbers(element) -> list[int]:
    return [int(n) - 1 for n in element.text.replace("\n", "").split(",")]


@pytest.mark.parametrize("nodes", [8, 20])
def test_mesh_and_sets(mesh, tmp_path, nodes) -> None:
    named = replace(mesh, sets={**mesh.sets, "cad_面": mesh.sets["x_min"]}, name="Lever")
    root = ElementTree.parse(export(named, tmp_path, "febio", nodes=nodes)).getroot()
    own, found = hex_elements(mesh, None, nodes), root.find("Mesh")
    points = np.array([node.text.split(",") for node in found.iter("node")], float)
    np.testing.assert_array_equal(points, own.points)
    for cell, part in enumerate(found.findall("Elements")):
        assert part.get("type") == f"hex{nodes}" and part.get("name").startswith(f"cell_{cell}")
        rows = [int(each.get("id")) - 1 for each in part]
        assert rows == np.flatnonzero(mesh.cell == cell).tolist()
        np.testing.assert_array_equal([numbers(each) for each in part], own.hexes[rows])
    sets = {each.get("name"): numbers(each) for each in found.findall("NodeSet")}
    faces = {each.get("name"): [numbers(q) for q in each] for each in found.findall("Surface")}
    assert set(sets) == set(faces) == set(named.sets)
    for name, quads in named.sets.items():
        np.testing.assert_array_equal(faces[name], own.quads[quads])
        assert sets[name] == np.unique(own.quads[quads]).tolist()
    hexes = {each.get("name"): numbers(each) for each in found.findall("ElementSet")}
    assert hexes["primitive_cube"] == np.flatnonzero(mesh.cell == 1).tolist()
    assert hexes["solid_Lever"] == list(range(len(mesh.hexes)))
    assert root.find("Material") is None and root.find("MeshDomains") is None
    if nodes == 8:
        assert volume_of(points, own.hexes) == pytest.approx(volume_of(mesh.vertices, mesh.hexes))
        assert sets["x_min"] == nodes_of(mesh, "x_min")


def test_the_material_is_in_the_units_of_the_part(mesh, tmp_path) -> None:
    problem = build("analysis", {"plugin": "modal", "units": "mm"}).problem
    path = provide(build("export", {"plugin": "febio"}), problem=problem)(mesh, tmp_path / "hex")
    root = ElementTree.parse(path).getroot()
    assert root.get("version") == "4.0" and root.find("Module").get("type") == "solid"
    [material] = root.find("Material")
    assert material.get("type") == "isotropic elastic"
    values = {each.tag: float(each.text) for each in material}
    assert values == pytest.approx({"E": 210000, "v": 0.3, "density": 7.85e-9})
    parts = {each.get("name") for each in root.find("Mesh").findall("Elements")}
    domains = {each.get("name"): each.get("mat") for each in root.find("MeshDomains")}
    assert domains == dict.fromkeys(parts, "material")
    assert re.search("<!--\nlength mm, force N, time s, mass t", path.read_text())


def test_conduction_has_no_elastic_material(mesh, tmp_path) -> None:
    problem = build("analysis", {"plugin": "poisson"}).problem
    path = provide(build("export", {"plugin": "febio"}), problem=problem)(mesh, tmp_path / "hex")
    assert ElementTree.parse(path).getroot().find("Material") is None


def test_27_nodes_are_refused() -> None:
    with pytest.raises(ValueError, match="nodes must be a whole number, 8 or 20; got 27"):
        build("export", {"plugin": "febio", "nodes": 27})


BOX = hex_box((4, 2, 2), (4.0, 2.0, 2.0))
PLANE = {"plane": [0, 1, 0, 2]}
PULL = {
    "plugin": "static",
    "units": "mm",
    "fixed": ["x_min", {"at": "y_min", "components": ["y"], "value": 0.5}],
    "loads": [
        {"at": "x_max", "force": [8, 0, 0], "traction": [0, 1e6, 0]},
        {"at": PLANE, "pressure": 2e6, "force": [0, 0, 4]},
    ],
    "gravity": [0, 0, -9.81],
}


def deck(folder, analysis, **options) -> ElementTree.Element:
    plugin = build("export", {"plugin": "febio", **options})
    problem = build("analysis", analysis).problem
    return ElementTree.parse(provide(plugin, problem=problem)(BOX, folder / "hex")).getroot()


@pytest.mark.parametrize("nodes", [8, 20])
def test_a_static_problem_is_complete(tmp_path, nodes) -> None:
    """Millimetres, newtons, tonnes; a body force is against the acceleration that it stands for."""
    root = deck(tmp_path, PULL, nodes=nodes)
    sections = [each.tag for each in root]
    assert sections == [
        *("Module", "Control", "Material", "Mesh", "MeshDomains", "Boundary", "Loads")
    ]
    assert root.find("Control/analysis").text == "STATIC"
    own, mesh = hex_elements(BOX, None, nodes), root.find("Mesh")
    sets = {each.get("name"): set(numbers(each)) for each in mesh.findall("NodeSet")}
    at_x, at_y = (
        set(own.quads[boundary_sets(BOX)[n]].ravel().tolist()) for n in ("x_min", "y_min")
    )
    held = {}
    for each in root.find("Boundary"):
        leaves = {leaf.tag: leaf.text for leaf in each}
        if each.get("type") == "zero displacement":
            [(axis, value)] = leaves.items()
            assert axis.endswith("_dof") and value == "1"
            held[axis[0]] = each.get("node_set"), 0.0
        else:
            assert each.get("type") == "prescribed displacement" and leaves["relative"] == "0"
            held[f"{leaves['dof']} moved"] = each.get("node_set"), float(leaves["value"])
    assert {axis: sets[name] for axis, (name, _) in held.items()} == {
        **{"x": at_x, "z": at_x, "y": at_x - at_y, "y moved": at_y}
    }
    assert [value for _, value in held.values()] == [0, 0, 0, 0.5]
    faces = {each.get("name"): [numbers(q) for q in each] for each in mesh.findall("Surface")}
    loads = [(each.tag, each.get("type"), each.get("surface")) for each in root.find("Loads")]
    assert loads == [
        ("surface_load", "traction", "x_max"),
        ("surface_load", "pressure", "load_2"),
        ("surface_load", "traction", "load_2"),
        ("body_load", "body force", None),
    ]
    for name, place in (("x_max", "x_max"), ("load_2", "y_max")):
        quads = own.quads[boundary_sets(BOX)[place]]
        assert corners(np.array(faces[name])) == corners(quads)
        a, b, c = (own.points[np.array(faces[name])[:, k]] for k in range(3))
        assert (np.cross(b - a, c - a) @ np.eye(3)["xyz".index(place[0])] > 0).all()  # outwards
    pull, press, push, gravity = root.find("Loads")
    assert [float(x) for x in pull.find("traction").text.split(",")] == [8 / 4, 1, 0]
    assert float(press.find("pressure").text) == 2 and press.find("linear").text == "1"
    assert [float(x) for x in push.find("traction").text.split(",")] == [0, 0, 4 / 8]
    assert pull.find("scale").text == "1"
    assert [float(x) for x in gravity.find("force").text.split(",")] == pytest.approx([0, 0, 9810])


def test_modes_have_supports_and_no_step(tmp_path) -> None:
    root = deck(tmp_path, {"plugin": "modal", "fixed": ["x_min"]})
    assert [each.tag for each in root] == ["Module", "Material", "Mesh", "MeshDomains", "Boundary"]
    assert {each.get("node_set") for each in root.find("Boundary")} == {"x_min"}


def test_without_a_step_there_is_only_the_mesh(tmp_path) -> None:
    assert [each.tag for each in deck(tmp_path, PULL, step=False)] == ["Module", "Mesh"]


def test_a_place_that_does_not_exist_is_refused(tmp_path) -> None:
    with pytest.raises(InputError, match="no boundary set 'hole_1'"):
        deck(tmp_path, {"plugin": "modal", "fixed": ["hole_1"]})
    assert not list(tmp_path.iterdir())
