"""FEBio, read as XML by the names of its manual."""

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from polycube.registry import build, provide
from polycube.spline.second_order import hex_elements
from tests.fixtures.exports import export, nodes_of, volume_of


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
    with pytest.raises(ValueError, match="nodes must be 8 or 20; got 27"):
        build("export", {"plugin": "febio", "nodes": 27})
