"""The page of an assembly: rows, links, contacts."""

import re
from dataclasses import replace

import numpy as np

from polycube.hexmesh.connectivity import hex_mesh
from polycube.report.page.html import assembly_page
from polycube.types import HexMesh
from tests.fixtures.hexmeshes import unit_cubes

FEATURES = {kind: {"all": 4, "lost": 1} for kind in ("points", "curves", "faces")}


def solid(name, **more):
    row = {"name": name, "number": 1, "volume": 2.0, "exit": 0, "result": "valid", "says": ""}
    return {**row, "hexes": 1, "min_scaled_jacobian": 0.5, "features": FEATURES, **more}


def report(contacts):
    failed = {"exit": 2, "result": "refused", "says": "a <void>", "hexes": None}
    solids = [solid("plate"), solid("pin", same_as="plate"), solid("bad", **failed, features=None)]
    return {"valid": False, "failure": "no", "solids": solids, "contacts": contacts, "hex": {}}


def contact(agree, **more):
    faces = {
        "solids": ["plate", "pin"],
        "faces": ["cad_face_1", "cad_face_2"],
        "names": ["top", ""],
    }
    return {**faces, "area": 3.0, "agree": agree, **more}


def mesh() -> HexMesh:
    """Two cubes, each a solid."""
    found = hex_mesh(*unit_cubes(2, 1, 1), cell=np.array([0, 1]))
    return replace(found, primitives=("plate", "pin", "bad"))


def test_only_reports_that_are_there_are_linked(tmp_path):
    for name in ("plate", "bad"):
        (tmp_path / name).mkdir()
    (tmp_path / "plate" / "report.html").touch()
    page = assembly_page("a<b.step", report([]), None, tmp_path, ["hex.vtu"])
    assert re.findall(r'<td><a href="([^"]*)"', page) == ["plate/report.html"]
    assert '<a href="hex.vtu">' in page and "a&lt;b.step" in page
    assert "a &lt;void&gt;" in page and page.count("9 of 12") == 2
    assert "No two solids touch" in page


def test_contacts_say_how_much_of_them_the_meshes_share(tmp_path):
    shared = {"common_quads": 2, "common_area": 3.0, "joined": "shared vertices"}
    agreeing = contact(True, quads=[4, 2], **shared)
    part = contact(False, quads=[4, 2], common_quads=1, common_area=1.5, joined="tie")
    page = assembly_page("a", report([agreeing, part, contact(None)]), None, tmp_path, [])
    rows = [re.findall("<td>(.*?)</td>", row) for row in re.findall("<tr>(.*?)</tr>", page)]
    found = [row[3:] for row in rows if row and row[0] == "plate – pin"]
    assert found == [
        ["yes", "shared vertices", "4 – 2", "2", "100 %"],
        ["no", "tie", "4 – 2", "1", "50 %"],
        ["–", "–", "–", "–", "–"],
    ]
    assert page.count("cad_face_1 (top) – cad_face_2") == 3


def test_the_view_is_coloured_by_the_names_of_the_solids(tmp_path):
    page = assembly_page("a", report([]), mesh(), tmp_path, [])
    assert re.findall(r'<option value="\w+">([^<]*)</option>', page)[:2] == [
        "scaled Jacobian",
        "solid",
    ]
    assert "grid cell" not in page
