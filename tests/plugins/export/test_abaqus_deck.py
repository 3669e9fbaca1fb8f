"""The input deck of a problem: its lines, and the forces at its nodes."""

import re
from dataclasses import replace

import numpy as np
import pytest

from polycube.analysis.boundary_sets import quads_of
from polycube.analysis.problem import MATERIALS
from polycube.errors import InputError
from polycube.hexmesh.named_sets import boundary_sets
from polycube.registry import build, provide
from polycube.spline.second_order import hex_elements
from tests.fixtures.hexmeshes import hex_box, hex_cylinder


def deck(mesh, folder, analysis, spline=None, **options) -> str:
    problem = build("analysis", analysis).problem
    plugin = provide(build("export", {"plugin": "abaqus", **options}), problem=problem)
    return provide(plugin, spline=spline)(mesh, folder / "hex").read_text()


def after(text: str, keyword: str) -> list[str]:
    """Data lines of the first card with a keyword."""
    found = text.split(f"\n{keyword}")[1].split("\n", 1)[1]
    return found.split("\n*")[0].splitlines()


def forces(text: str, n: int) -> np.ndarray:
    found = np.zeros((n, 3))
    for row in after(text, "*CLOAD"):
        node, axis, value = row.split(", ")
        found[int(node) - 1, int(axis) - 1] = float(value)
    return found


BOX = hex_box((4, 2, 2), (4.0, 2.0, 2.0))
PULL = {"plugin": "static", "fixed": ["x_min"], "loads": [{"at": "x_max", "force": [8, 0, 0]}]}


def test_a_static_deck_in_mm_is_in_newtons_tonnes_and_megapascals(tmp_path) -> None:
    more = {"at": "z_max", "pressure": 2e6}
    analysis = {**PULL, "loads": [*PULL["loads"], more], "gravity": [0, 0, -9.81]}
    text = deck(BOX, tmp_path, analysis)
    assert "** length mm, force N, time s, mass t, stress MPa\n" in text
    assert "*ELEMENT, TYPE=C3D8I, ELSET=all\n" in text
    assert after(text, "*ELASTIC") == ["210000., 0.3"]
    assert after(text, "*DENSITY") == ["7.85e-09"]
    assert after(text, "*BOUNDARY") == [f"x_min, {i}, {i}, 0." for i in (1, 2, 3)]
    assert after(text, "*DSLOAD") == ["z_max, P, 2."]
    [gravity] = after(text, "*DLOAD")
    assert gravity.startswith("all, GRAV, 9810., ") and gravity.split(", ")[-1] == "-1."
    steps = re.findall(r"^\*(STEP|STATIC|BOUNDARY|CLOAD|DLOAD|END STEP)", text, re.M)
    assert steps == ["STEP", "STATIC", "BOUNDARY", "CLOAD", "DLOAD", "END STEP"]


def test_the_solids_of_an_assembly_have_sections_of_their_own(tmp_path) -> None:
    mesh = replace(BOX, cell=(np.arange(16) >= 8).astype(int), primitives=("bar", "pin_2"))
    problem = build("analysis", {"plugin": "modal", "modes": 3}).problem
    problem = replace(problem, materials=(MATERIALS["steel"], MATERIALS["abs"]))
    plugin = provide(build("export", {"plugin": "abaqus"}), problem=problem)
    text = plugin(mesh, tmp_path / "hex").read_text()
    sections = re.findall(r"^\*SOLID SECTION, ELSET=(\w+), MATERIAL=(\w+)$", text, re.M)
    assert sections == [(f"primitive_{n}", f"material_{n}") for n in ("bar", "pin_2")]
    for name, values in [
        ("bar", ["210000., 0.3", "7.85e-09"]),
        ("pin_2", ["2300., 0.35", "1.05e-09"]),
    ]:
        own = f"\n{text.partition(f'NAME=material_{name}')[2]}"
        assert [after(own, card)[0] for card in ("*ELASTIC", "*DENSITY")] == values
        assert f"*ELSET, ELSET=primitive_{name}\n" in text
    assert after(text, "*FREQUENCY") == ["3"]


@pytest.mark.parametrize(
    ("unit", "young", "density", "gravity", "line"),
    [
        ("m", "210000000000.", "7850.", "9.81", "mass kg, stress Pa"),
        ("cm", "21000000.", "7.85e-05", "981.", "mass N s^2/cm, stress N/cm^2"),
    ],
)
def test_other_units_are_converted_consistently(
    unit, young, density, gravity, line, tmp_path
) -> None:
    text = deck(BOX, tmp_path, {"plugin": "static", "units": unit})
    assert line in text
    assert float(after(text, "*ELASTIC")[0].split(",")[0]) == pytest.approx(float(young))
    assert float(after(text, "*DENSITY")[0]) == pytest.approx(float(density))
    assert f"all, GRAV, {gravity}, " in text


@pytest.mark.parametrize("element", ["C3D8I", "C3D20R"])
def test_nodal_forces_have_the_exact_sum_and_the_published_shares_on_squares(
    element, tmp_path
) -> None:
    """8 N on four unit squares: a quarter each at corners; -1/12 there and 1/3 at mid-edges."""
    text = deck(BOX, tmp_path, PULL, element=element)
    own = hex_elements(BOX, None, 20 if "20" in element else 8)
    found = forces(text, len(own.points))
    assert found.sum(axis=0) == pytest.approx([8, 0, 0], abs=1e-12)
    expected = np.zeros(len(own.points))
    weights = [1 / 4] * 4 if element == "C3D8I" else [-1 / 12] * 4 + [1 / 3] * 4
    for quad in own.quads[quads_of(BOX, "x_max")]:
        expected[quad] += 2 * np.array(weights)
    np.testing.assert_allclose(found[:, 0], expected, atol=1e-12)


@pytest.mark.parametrize("element", ["C3D8", "C3D20"])
def test_a_traction_has_the_correct_moment(element, tmp_path) -> None:
    """On skew faces too; its resultant acts at their centroid."""
    mesh = hex_cylinder()
    loads = [{"at": "z_max", "traction": [0, 0, 3e6]}]
    text = deck(mesh, tmp_path, {"plugin": "static", "loads": loads}, element=element)
    own = hex_elements(mesh, None, 20 if "20" in element else 8)
    found = forces(text, len(own.points))
    quads = mesh.vertices[mesh.quads[quads_of(mesh, "z_max")]]
    halves = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    normals = np.cross(halves[:, 1] - halves[:, 0], halves[:, 2] - halves[:, 0]) / 2
    area = normals[:, 2]
    assert found.sum(axis=0) == pytest.approx([0, 0, 3 * area.sum()])
    moment = 3 * (area[:, None] * np.cross(halves.mean(axis=1), [0, 0, 1])).sum(axis=0)
    assert np.cross(own.points, found).sum(axis=0) == pytest.approx(moment, abs=1e-9)


def test_the_last_support_has_precedence_at_common_nodes(tmp_path) -> None:
    fixed = ["x_min", {"at": "z_min", "components": "z", "value": 0.5}]
    text = deck(BOX, tmp_path, {"plugin": "static", "fixed": fixed})
    rows = after(text, "*BOUNDARY")
    names = ["x_min, 1, 1, 0.", "x_min, 2, 2, 0.", "fixed_1_3, 3, 3, 0.", "z_min, 3, 3, 0.5"]
    assert rows == names
    own = {int(n) - 1 for row in after(text, "*NSET, NSET=fixed_1_3") for n in row.split(",")}
    ends = [set(np.unique(BOX.quads[quads_of(BOX, name)])) for name in ("x_min", "z_min")]
    assert own == ends[0] - ends[1]


def test_a_supported_edge_is_the_nodes_of_both_sides(tmp_path) -> None:
    edge = {"at": {"edge": ["x_min", "z_min"]}, "components": ["z"]}
    text = deck(BOX, tmp_path, {**PULL, "fixed": ["x_max", edge]})
    own = [int(node) for row in after(text, "*NSET, NSET=fixed_2_3") for node in row.split(",")]
    assert BOX.vertices[np.array(own) - 1].tolist() == [[0, 0, 0], [0, 1, 0], [0, 2, 0]]
    assert "fixed_2_3, 3, 3, 0." in after(text, "*BOUNDARY")


def test_boxes_and_planes_have_separate_sets(tmp_path) -> None:
    plane = {"plane": [0, 0, 1, 2]}
    analysis = {
        "plugin": "static",
        "fixed": [{"at": {"box": [0, 0, 0, 0, 2, 2]}, "components": "x"}],
        "loads": [{"at": plane, "pressure": 1e6}],
    }
    text = deck(BOX, tmp_path, analysis)
    assert after(text, "*BOUNDARY") == ["fixed_1_1, 1, 1, 0."]
    assert after(text, "*DSLOAD") == ["load_1, P, 1."]
    named = after(text, "*SURFACE, TYPE=ELEMENT, NAME=load_1")
    assert sorted(named) == sorted(after(text, "*SURFACE, TYPE=ELEMENT, NAME=z_max"))


def test_a_modal_deck_requests_its_modes(tmp_path) -> None:
    text = deck(BOX, tmp_path, {"plugin": "modal", "modes": 7, "fixed": ["x_min"]})
    assert after(text, "*FREQUENCY") == ["7"] and "lumped" not in text
    lumped = deck(BOX, tmp_path, {"plugin": "modal", "mass": "lumped"})
    assert "not analysis.mass=lumped" in lumped and "*BOUNDARY" not in lumped


def test_a_deck_of_heat_conduction(tmp_path) -> None:
    analysis = {
        "plugin": "poisson",
        "fixed": [{"at": "x_min", "value": 300}],
        "flux": [{"at": "x_max", "value": 4000}],
        "source": 5e6,
    }
    text = deck(BOX, tmp_path, analysis, element="C3D20R")
    assert "*ELEMENT, TYPE=DC3D20, ELSET=all\n" in text
    assert "power N mm/s, temperature K" in text
    assert after(text, "*CONDUCTIVITY") == ["50."]
    assert after(text, "*BOUNDARY") == ["x_min, 11, 11, 300."]
    rows = after(text, "*DFLUX")
    assert rows[-1] == "all, BF, 5." and len(rows) == 5
    faces = [row.rpartition(", ") for row in rows[:-1]]
    assert {float(value) for *_, value in faces} == {4.0}
    named = [row for row, *_ in faces]
    assert sorted(named) == sorted(after(text, "*SURFACE, TYPE=ELEMENT, NAME=x_max"))


def test_without_loads_there_is_no_step_and_without_a_problem_no_material(tmp_path) -> None:
    idle = deck(BOX, tmp_path, {"plugin": "static", "gravity": [0, 0, 0]})
    assert "*ELASTIC" in idle and "*STEP" not in idle and "there is no step" in idle
    bare = build("export", {"plugin": "abaqus"})(BOX, tmp_path / "bare").read_text()
    assert "add material, section and step" in bare and "*MATERIAL" not in bare
    mesh_only = deck(BOX, tmp_path, PULL, step=False)
    assert "*MATERIAL" not in mesh_only and "*SURFACE" in mesh_only


def test_a_missing_place_is_refused(tmp_path) -> None:
    with pytest.raises(InputError, match="no boundary set 'hole_1'"):
        deck(BOX, tmp_path, {"plugin": "modal", "fixed": ["hole_1"]})
    assert not list(tmp_path.iterdir())


def test_places_have_the_names_of_the_file(tmp_path) -> None:
    """A set of the problem whose name is transliterated, and one that gets a number."""
    sides = boundary_sets(BOX)
    sets = {"cad_固定面": sides["x_min"], "cad_é": sides["z_max"], "cad_e": sides["z_min"]}
    load = {"at": "cad_e", "pressure": 1e6}
    analysis = {"plugin": "static", "fixed": ["cad_固定面"], "loads": [load]}
    text = deck(replace(BOX, sets=sets), tmp_path, analysis)
    assert after(text, "*BOUNDARY")[0] == "cad_u56fau5b9au9762, 1, 1, 0."
    assert after(text, "*DSLOAD") == ["cad_e__2, P, 1."]
    nodes = [int(n) for row in after(text, "*NSET, NSET=cad_e__2") for n in row.split(", ")]
    assert nodes == (np.unique(BOX.quads[sets["cad_e"]]) + 1).tolist()
