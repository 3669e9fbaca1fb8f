"""All solids of a file: a run each, identical ones meshed once, one mesh and one page."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest

from polycube.assembly.combined import combined
from polycube.cli.infer import _command
from polycube.cli.infer import _silently as attempt
from polycube.cli.signals import INTERRUPTED
from polycube.cli.solids.run import run_solids
from polycube.config import compose
from polycube.errors import InputError
from polycube.io.hex_meshes import read_hexes
from polycube.io.solids.listing import Solid, read_solids
from polycube.io.solids.motions import Motion
from tests.conftest import first_quick
from tests.fixtures import assemblies, cad_parts
from tests.fixtures.runs import config, tree

NAMES = ("left", "right", "top", "hollow")
QUICK = ["meshing.size=20%", "structure=slices"]  # four hexes along a cube


@pytest.fixture(scope="module")
def cubes(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cubes")
    return assemblies.named(assemblies.write("cubes", folder), *NAMES)


@pytest.fixture(scope="module")
def done(cubes, tmp_path_factory):
    """Results of three cubes, and a fourth that is refused, with exit code."""
    folder = tmp_path_factory.mktemp("results")
    words = ["cad.solid=all", "order=[meshing]", "export=[abaqus]", f"output_dir={folder}"]
    words += ["cad.interfaces=tie"]
    return _command(config(f"mesh={cubes}", *words, *QUICK)), folder


def report(folder):
    return json.loads((folder / "report.json").read_text())


@pytest.mark.slow
def test_one_failure_leaves_the_others_alone_and_the_worst_code_counts(done):
    code, folder = done
    assert code == 2
    rows = {row["name"]: row for row in report(folder)["solids"]}
    assert list(rows) == list(NAMES)
    assert [row["exit"] for row in rows.values()] == [0, 0, 0, 2]
    assert [row["number"] for row in rows.values()] == [1, 2, 3, 4]
    assert rows["hollow"]["says"].startswith("the solid has an inner void")
    assert [row["hexes"] for row in rows.values()] == [64, 64, 64, None]
    assert [row["min_scaled_jacobian"] for row in list(rows.values())[:3]] == pytest.approx([1] * 3)
    assert rows["top"]["features"]["points"] == {"all": 8, "lost": 0}
    assert not report(folder)["valid"] and "1 of 4 solids: hollow" in report(folder)["failure"]
    assert {"left/hex.inp", "left/hex.vtu", "right/hex.inp", "report.html"} <= tree(folder)
    assert "hex.inp" not in tree(folder)  # solvers see no mark


@pytest.mark.slow
def test_the_same_solid_is_meshed_once_and_moved(done):
    _, folder = done
    rows = {row["name"]: row.get("same_as") for row in report(folder)["solids"]}
    assert rows == {"left": None, "right": "left", "top": None, "hollow": None}
    left, right = (read_hexes(folder / name / "hex.vtu")[0] for name in ("left", "right"))
    np.testing.assert_allclose(right.vertices, left.vertices + np.array([10, 0, 0]), atol=1e-9)
    np.testing.assert_array_equal(right.hexes, left.hexes)
    spent = report(folder / "right")["seconds"]
    assert not any(name.startswith("meshing") for name in spent)
    assert any(name.startswith("meshing") for name in report(folder / "left")["seconds"])


@pytest.mark.slow
def test_meshes_agree_where_equal_cubes_touch_and_not_at_the_small_one(done):
    _, folder = done
    first, second = report(folder)["contacts"]
    assert first["solids"] == ["left", "right"] and second["solids"] == ["left", "top"]
    assert first["faces"] == ["cad_face_2", "cad_face_1"]
    assert (first["agree"], second["agree"]) == (True, False)
    assert (first["joined"], second["joined"]) == ("shared vertices", "tie")
    assert first["area"] == pytest.approx(100) == first["common_area"]
    assert second["area"] == pytest.approx(25) and second["common_area"] == 0
    assert first["quads"] == [16, 16] and first["common_quads"] == 16


@pytest.mark.slow
def test_the_mesh_of_all_names_the_solids_and_has_one_vertex_where_they_agree(done):
    _, folder = done
    text = (folder / "hex.vtu").read_text()
    assert "<!-- solid: 1 left, 2 right, 3 top, 4 hollow -->" in text
    mesh = meshio.read(folder / "hex.vtu")
    solid = mesh.cell_data["solid"][0].ravel()
    np.testing.assert_array_equal(solid, np.repeat([1, 2, 3], 64))
    assert len(mesh.points) == 9 * 5 * 5 + 5**3
    hexes = mesh.cells[0].data
    for number, (low, high) in enumerate(
        [([0, 0, 0], [10, 10, 10]), ([10, 0, 0], [20, 10, 10]), ([3, 3, 10], [8, 8, 15])], start=1
    ):
        own = mesh.points[np.unique(hexes[solid == number])]
        np.testing.assert_allclose([own.min(axis=0), own.max(axis=0)], [low, high], atol=1e-6)


@pytest.mark.slow
def test_results_are_reused_unless_a_setting_changes(done, cubes, capsys):
    _, folder = done
    words = ["cad.solid=all", "order=[meshing]", "export=[abaqus]", f"output_dir={folder}"]
    words += ["cad.interfaces=tie"]
    assert _command(config(f"mesh={cubes}", *words, *QUICK)) == 2
    lines = capsys.readouterr().err.splitlines()
    assert [line.partition(":")[0] for line in lines[:4]] == list(NAMES)
    assert all(", as before" in line for line in lines[:4])
    assert lines[4].startswith("3 valid, 1 refused, meshes agree at 1 of 2 contacts: ")
    assert lines[5] == "error: no valid result of 1 of 4 solids: hollow"


def combined_again(cubes, folder, *more):
    """Exit code and sentence of the valid three of the cubes, from the results of their runs."""
    words = ["cad.solid=all", "order=[meshing]", "export=[abaqus]", f"output_dir={folder}"]
    words += ["cad.interfaces=tie"]
    cfg = compose("infer", [f"mesh={cubes}", *words, *QUICK, *more])
    return run_solids(cfg, read_solids(cubes)[:3], folder, lambda cfg: (1, "it was run again"))


@pytest.mark.slow
def test_solvers_get_the_mesh_of_all_where_all_are_valid(done, cubes, tmp_path):
    folder = shutil.copytree(done[1], tmp_path / "again")
    assert combined_again(cubes, folder) == (0, "") and report(folder)["valid"]
    deck = (folder / "hex.inp").read_text()
    assert "ELSET=primitive_left" in deck and "NAME=top_x_min" in deck
    assert "NAME=left_x_max" not in deck  # it is inside
    assert deck.count("*TIE") == 1 and "\ntop_cad_face_5, left_cad_face_6\n" in deck
    assert len(meshio.read(folder / "hex.inp").points) == 9 * 5 * 5 + 5**3
    assert combined_again(cubes, folder, "cad.interfaces=separate") == (0, "")
    assert "*TIE" not in (folder / "hex.inp").read_text()
    assert len(meshio.read(folder / "hex.inp").points) == 3 * 5**3


@pytest.mark.slow
def test_solids_that_touch_are_meshed_together(cubes, tmp_path, capsys):
    words = ["cad.solid=all", "order=[meshing]", "export=[abaqus]", "meshing.size=2.5"]
    cfg = compose("infer", [f"mesh={cubes}", *words, f"output_dir={tmp_path / 'out'}"])
    assert run_solids(cfg, read_solids(cubes)[:3], tmp_path / "out", attempt) == (0, "")
    assert "left, right, top are meshed together\n" in capsys.readouterr().err
    found = report(tmp_path / "out")
    assert [each["joined"] for each in found["contacts"]] == ["shared vertices"] * 2
    assert [each["area"] for each in found["contacts"]] == pytest.approx([100, 25])
    assert "*TIE" not in (tmp_path / "out" / "hex.inp").read_text()
    assert found["hex"]["features"]["curves"] == {"all": 36, "lost": 0}
    assert found["mesh_warnings"] == []


@pytest.mark.slow
def test_solids_that_are_meshed_together_are_only_analysed_together(tmp_path):
    bars = assemblies.named(assemblies.write("bars", tmp_path), "first", "second")
    words = ["cad.solid=all", "meshing.size=5", "analysis=modal", "analysis.modes=8"]
    folder = tmp_path / "out"
    cfg = compose("infer", [f"mesh={bars}", *words, f"output_dir={folder}"])
    assert run_solids(cfg, read_solids(bars), folder, attempt) == (0, "")
    assert len(report(folder)["modes"]["frequency_hz"]) == 8
    for name in ("first", "second"):
        alone = report(folder / name)
        assert alone["valid"] and "modes" not in alone and "spline" not in alone
    both = report(folder)["spline"]
    assert both["elements"] == 2 * 2 * (8 + 12) and both["functions"] == 3 * 3 * (8 + 12 + 1)


@pytest.mark.slow
def test_solids_without_a_common_structure_are_tied_and_the_report_says_why(done, cubes, tmp_path):
    folder = shutil.copytree(done[1], tmp_path / "again")
    assert combined_again(cubes, folder, "cad.interfaces=conform") == (0, "")
    assert (folder / "hex.inp").read_text().count("*TIE") == 1
    why = "left, right, top are meshed one by one, because they are not a sweep or a turned part"
    assert report(folder)["mesh_warnings"][0].startswith(why)


def posed_again(cubes, folder, *more):
    """The valid three of the cubes with materials, one held and one pulled, from earlier meshes."""
    words = ["cad.solid=all", "order=[meshing]", DECK, "analysis=static", f"output_dir={folder}"]
    words += ["cad.materials={left: steel, 2: abs}", "analysis.material=brass"]
    words += ["cad.interfaces=tie"]
    cfg = compose("infer", [f"mesh={cubes}", *words, *QUICK, *more])
    return run_solids(cfg, read_solids(cubes)[:3], folder, lambda cfg, placed=None: (0, ""))


@pytest.mark.slow
def test_the_deck_of_all_states_materials_supports_and_loads(done, cubes, tmp_path):
    folder = shutil.copytree(done[1], tmp_path / "again")
    words = ["analysis.fixed=[x_min]", "analysis.loads=[{at: right_x_max, pressure: 2e6}]"]
    assert posed_again(cubes, folder, *words) == (0, "")
    deck = (folder / "hex.inp").read_text()
    assert "ELSET=primitive_right, MATERIAL=material_right\n" in deck
    assert "NAME=material_right\n*ELASTIC\n2300., 0.35\n*DENSITY\n1.05e-09\n" in deck
    assert "*BOUNDARY\nx_min, 1, 1, 0.\n" in deck and "*DSLOAD\nright_x_max, P, 2.\n" in deck
    assert deck.index("*STATIC") < deck.index("*DSLOAD") < deck.index("*END STEP")
    found = report(folder)
    assert [row["material"].split(":")[0] for row in found["solids"]] == ["Steel", "Abs", "Brass"]
    masses = [7850e-6, 1050e-6, 8500 * 125e-9]
    assert [row["mass"] for row in found["solids"]] == pytest.approx(masses)
    assert found["solids"][2]["material"].startswith("Brass: Young")
    assert [row["words"] for row in found["problem"]["supports"]] == ["Face 'x_min' is clamped"]
    [load] = found["problem"]["loads"]
    assert load["area"] == pytest.approx(100) and "'right_x_max'" in load["words"]
    page = (folder / "report.html").read_text()
    assert "Pressure of 2 MPa on face &#39;right_x_max&#39;" in page and ">Brass</td>" in page
    with pytest.raises(InputError, match="no boundary set 'left_x_max'; there are left_x_min, "):
        posed_again(cubes, folder, "analysis.fixed=[left_x_max]")
    assert (folder / "hex.inp").read_text() == deck


def solved_again(cubes, folder, *more, number=2):
    """Exit code and sentence of the first solids, analysed together, from earlier meshes."""
    words = [f"mesh={cubes}", "cad.solid=all", *QUICK, f"output_dir={folder}", *more]
    words += ["cad.interfaces=tie"]
    solids = read_solids(cubes)[:number]
    return run_solids(compose("infer", words), solids, folder, lambda cfg, placed=None: (0, ""))


SLIDING = "[{at: x_min, components: [x]}, {at: y_min, components: [y]}, "
SLIDING += "{at: z_min, components: [z]}]"


@pytest.mark.slow
def test_solids_that_share_vertices_are_analysed_together(done, cubes, tmp_path, capsys):
    """Tension with nu / E the same in both, so that the stress is uniform."""
    folder = shutil.copytree(done[1], tmp_path / "again")
    words = ["analysis=static", f"analysis.fixed={SLIDING}"]
    words += ["cad.materials={left: {young: 2e11, poisson: 0.3, density: 1000}}"]
    words += ["analysis.material={young: 1e11, poisson: 0.15, density: 1000}"]
    words += ["analysis.loads=[{at: right_x_max, pressure: -2e6}]"]
    assert solved_again(cubes, folder, *words) == (0, "")
    found = report(folder)
    static = found["static"]
    far = np.linalg.norm([10 * 1e-5 + 10 * 2e-5, 3e-5, 3e-5])
    assert static["max_displacement"] == pytest.approx(far, rel=1e-6)
    assert static["max_von_mises"] == pytest.approx(2e6, rel=1e-6)
    assert static["reactions"][0]["force"] == pytest.approx([-200, 0, 0], abs=1e-6)
    assert found["spline"]["functions"] == 9 * 5 * 5
    mesh = meshio.read(folder / "static.vtu")
    at = np.isclose(mesh.points[:, 0], 10)
    assert mesh.point_data["displacement"][at, 0] == pytest.approx(1e-4, rel=1e-6)
    assert "largest displacement 0.000303 mm at (20, 10, 10)" in capsys.readouterr().err
    page = (folder / "report.html").read_text()
    assert "At rest under load" in page and "data:image/png;base64," in page


@pytest.mark.slow
def test_conductivities_are_those_of_the_solids(done, cubes, tmp_path):
    folder = shutil.copytree(done[1], tmp_path / "again")
    words = ["analysis=poisson", "cad.materials={left: 100, right: 300}", DECK]
    words += ["analysis.fixed=[{at: x_min, value: 0}, {at: x_max, value: 4}]"]
    assert solved_again(cubes, folder, *words) == (0, "")
    found = report(folder)
    assert [row["material"] for row in found["solids"]] == [
        f"Conductivity {k} W/(m K)" for k in (100, 300)
    ]
    flux = 4 / (0.01 / 100 + 0.01 / 300)
    assert found["poisson"]["max_flux"] == pytest.approx(flux, rel=1e-6)
    deck = (folder / "hex.inp").read_text()
    assert "NAME=material_left\n*CONDUCTIVITY\n100.\n" in deck
    assert "NAME=material_right\n*CONDUCTIVITY\n300.\n" in deck


@pytest.mark.slow
def test_solids_without_shared_vertices_need_a_deck(done, cubes, tmp_path):
    folder = shutil.copytree(done[1], tmp_path / "again")
    apart = "the meshes of left and top share no vertices where left_cad_face_6 touches top_cad_fa"
    with pytest.raises(InputError, match=f"{apart}.*a deck of export=.abaqus. can have ties"):
        solved_again(cubes, folder, "analysis=static", number=3)
    assert solved_again(cubes, folder, "analysis=static", DECK, number=3) == (0, "")
    assert apart in (folder / "report.html").read_text() and "static" not in report(folder)
    with pytest.raises(InputError, match="use spline=h2s without refinement"):
        solved_again(cubes, folder, "analysis=static", "spline=optimal")
    with pytest.raises(InputError, match="leave 3 of 6 rigid motions free"):
        held = "analysis.fixed=[{at: x_min, components: [x]}]"
        solved_again(cubes, folder, "analysis=static", held)
    assert solved_again(cubes, folder, "spline=optimal") == (0, "")  # each solid has its modes
    assert "use spline=h2s" in report(folder)["not_analysed"] and "modes" not in report(folder)


@pytest.mark.slow
def test_meshes_that_are_not_valid_when_joined_are_no_valid_result(
    done, cubes, tmp_path, monkeypatch
):
    def mirrored(*given):
        mesh = combined(*given)
        return replace(mesh, vertices=-mesh.vertices)

    monkeypatch.setattr("polycube.cli.solids.result.combined", mirrored)
    folder = shutil.copytree(done[1], tmp_path / "again")
    code, why = combined_again(cubes, folder)
    assert code == 3 and why.endswith("but the joined mesh is not")
    assert not (folder / "hex.inp").exists()


@pytest.mark.slow
def test_preflight_of_all_solids_writes_nothing(cubes, here, capsys):
    assert _command(config(f"mesh={cubes}", "cad.solid=all", "preflight=true")) == 2
    out = capsys.readouterr().out
    assert "cad.solid=2, right, is 1 moved" in out and out.count("usable: closed") == 2
    assert not tree(here)


@pytest.mark.slow
def test_a_file_with_one_solid_is_one_run(tmp_path, capsys):
    path = cad_parts.write("bored_block", tmp_path)
    words = ["cad.solid=all", "order=[]", "structure=slices", f"output_dir={tmp_path / 'run'}"]
    assert _command(config(f"mesh={path}", *words)) == 0
    assert f"{path} contains one solid" in capsys.readouterr().err
    assert "solids" not in report(tmp_path / "run")


@pytest.mark.parametrize(
    ("words", "sentence"),
    first_quick(
        1,
        [
            (["hex=given.vtu"], "cad.solid=all cannot be combined with hex="),
            (["resume=old", "from=spline"], "resume the run of one solid, in its own folder"),
            (["preflight=places.vtp"], "a file of the places is for one solid"),
            (["cad.remove.faces=[1]"], "cad.remove.faces are faces of one solid"),
        ],
    ),
)
def test_settings_for_one_solid_are_refused(cubes, tmp_path, capsys, words, sentence):
    words = [f"mesh={cubes}", "cad.solid=all", f"output_dir={tmp_path / 'run'}", *words]
    assert _command(config(*words)) == 2
    assert sentence in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


SOLIDS = [
    Solid(1, "bolt_1", 1.0, 1),
    Solid(2, "plate", 2.0, 2),
    Solid(3, "bolt_3", 1.0, 1, Motion(np.eye(3), np.ones(3), np.arange(6))),
]


def settings(tmp_path, *words):
    return compose("infer", [f"mesh={tmp_path / 'file.step'}", "cad.solid=all", *words])


def recording(code=0, why=""):
    """A function in place of a run, and the list of solids for which it is called."""
    calls = []

    def attempt(cfg, placed=None):
        calls.append((cfg["cad"]["solid"], placed))
        return (code, why) if cfg["cad"]["solid"] == 1 else (0, "")

    return attempt, calls


ALL = [1, 2, 3]
DECK = "export=[abaqus]"
CONTACT, STATIC, MESHED = "cad.interfaces=contact", "analysis=static", "order=[meshing]"


def settings_of_runs(tmp_path, *words):
    """The settings with which the solids are run."""
    found = []

    def attempt(cfg, placed=None):
        found.append(cfg)
        return 0, ""

    solids = [replace(solid, motion=None) for solid in SOLIDS]
    assert run_solids(settings(tmp_path, *words), solids, tmp_path / "out", attempt) == (0, "")
    assert [cfg["cad"]["solid"] for cfg in found] == ALL
    assert all(cfg["cad"]["materials"] is None for cfg in found)
    return found


@pytest.mark.parametrize(
    ("given", "materials"),
    [
        ("{bolt_3: brass, plate: abs}", ["steel", "abs", "brass"]),
        ("{3: brass, plate: abs}", ["steel", "abs", "brass"]),
        ("{bolt: brass}", ["brass", "steel", "brass"]),  # the name of both in the file
    ],
)
def test_every_solid_is_run_with_its_material(tmp_path, given, materials):
    found = settings_of_runs(tmp_path, f"cad.materials={given}")
    assert [cfg["analysis"]["material"] for cfg in found] == materials
    assert all(cfg["analysis"]["plugin"] == "modal" for cfg in found)


def test_an_analysis_with_places_is_that_of_the_assembly(tmp_path):
    words = ["analysis.fixed=[plate_z_min, x_max]", "analysis.units=cm", DECK]
    found = settings_of_runs(tmp_path, *words, "cad.materials={plate: abs}")
    kept = [{"units": "cm", "material": name} for name in ("steel", "abs", "steel")]
    assert [cfg["analysis"] for cfg in found] == [{"plugin": None, **each} for each in kept]
    assert all(cfg["spline"] == {"plugin": None} for cfg in found)  # there is one of all solids
    words = ["analysis.fixed=[{box: [0, 0, 0, 1, 1, 1]}]", "order=[meshing]", "seed=2"]
    for cfg in settings_of_runs(tmp_path, *words):  # without analysis there is nothing to refuse
        assert cfg["analysis"]["plugin"] is None and cfg["spline"]["held"] == []


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (
            ["cad.materials={nut: steel}"],
            "no solid nut; the solids are 1 bolt_1, 2 plate, 3 bolt_3",
        ),
        (["cad.materials={4: steel}"], "there is no solid 4"),
        (["cad.materials=steel"], r"write cad.materials=\{bolt_1: steel\}"),
        (["cad.materials={plate: stone}"], "material must be one of steel, .* got 'stone'"),
        (["cad.materials={plate: abs}", "analysis=poisson"], "conductivity must be a number"),
        (["cad.materials={plate: abs}", "analysis=none"], "for an analysis of elastic solids"),
        (["analysis.fixed=[nut_z_min]", DECK], "'nut_z_min' is no place of an assembly; the sol"),
        (["analysis.fixed=[hole_1]", DECK], "write bolt_1_z_max for the set of a solid"),
        (["analysis.fixed=[{edge: [z_min, 7]}]", DECK], "7 is no place of an assembly"),
        ([CONTACT, STATIC, DECK], r"contact is only written to decks.*use order=\[meshing\]"),
        ([CONTACT, STATIC, MESHED], "cad.interfaces=contact: contact is only written to decks"),
        ([CONTACT, STATIC, MESHED, "export=[abaqus,gmsh]"], "contact is only written to decks"),
        ([CONTACT, "analysis=modal", MESHED, DECK], "contact is only written to decks of statics"),
    ],
)
def test_options_that_fit_no_solid_are_refused_before_the_runs(tmp_path, words, sentence):
    attempt, calls = recording()
    with pytest.raises(InputError, match=sentence):
        run_solids(settings(tmp_path, *words), SOLIDS, tmp_path / "out", attempt)
    assert calls == [] and not (tmp_path / "out").exists()


@pytest.mark.parametrize("value", ["0.2", "-1"])
def test_friction_is_only_for_contact(cubes, tmp_path, capsys, value):
    words = [f"mesh={cubes}", "cad.solid=all", f"cad.friction={value}"]
    assert _command(config(*words, f"output_dir={tmp_path / 'run'}")) == 2
    assert "cad.friction" in capsys.readouterr().err


@pytest.mark.parametrize("solid", ["null", "2"])
def test_materials_by_solid_are_not_for_one_solid(tmp_path, capsys, solid):
    words = ["mesh=a.step", f"cad.solid={solid}", "cad.materials={a: steel}"]
    assert _command(config(*words, f"output_dir={tmp_path / 'run'}")) == 2
    assert "give analysis.material" in capsys.readouterr().err


def test_a_copy_has_the_exit_code_of_its_original(tmp_path):
    attempt, calls = recording(3, "no luck")
    code, why = run_solids(settings(tmp_path), SOLIDS, tmp_path / "out", attempt)
    assert code == 3 and why == "no valid result of 2 of 3 solids: bolt_1, bolt_3"
    assert calls == [(1, None), (2, None)]
    assert report(tmp_path / "out")["solids"][2]["says"] == "as bolt_1: no luck"


@pytest.mark.slow
def test_results_of_an_earlier_run_are_not_those_of_a_refused_one(done, cubes, tmp_path):
    """The meshes are there, but this time every solid that is meshed was refused."""
    folder = shutil.copytree(done[1], tmp_path / "again")
    solids = read_solids(cubes)[:3]
    cfg = settings(tmp_path, "seed=7")
    code, why = run_solids(cfg, solids, folder, lambda cfg, placed=None: (2, "refused"))
    assert code == 2 and why == "no valid result of 3 of 3 solids: left, right, top"
    rows = report(folder)["solids"]
    assert [row["says"] for row in rows] == ["refused", "as left: refused", "refused"]
    assert [row["hexes"] for row in rows] == [None] * 3 and report(folder)["contacts"] == []
    assert not (folder / "hex.vtu").exists()


def test_with_regions_every_solid_is_meshed_separately(tmp_path):
    attempt, calls = recording()
    regions = "meshing.regions=[{box:[0,0,0,1,1,1],size:1%}]"
    run_solids(settings(tmp_path, regions), SOLIDS, tmp_path / "out", attempt)
    assert calls == [(1, None), (2, None), (3, None)]


def test_an_interrupted_run_goes_on_where_it_was(tmp_path):
    attempt, calls = recording(INTERRUPTED, "interrupted")
    with pytest.raises(KeyboardInterrupt):
        run_solids(settings(tmp_path), SOLIDS[::-1][1:], tmp_path / "out", attempt)
    assert calls == [(2, None), (1, None)] and not (tmp_path / "out" / "report.json").exists()
    attempt, calls = recording()
    assert run_solids(settings(tmp_path), SOLIDS[::-1][1:], tmp_path / "out", attempt) == (0, "")
    assert calls == [(1, None)]


def test_a_file_of_the_user_is_not_overwritten(tmp_path):
    (tmp_path / "hex.vtu").write_text("mine")
    attempt, calls = recording()
    with pytest.raises(InputError, match=r"hex\.vtu would be overwritten"):
        run_solids(settings(tmp_path), SOLIDS, Path(tmp_path), attempt)
    assert calls == []
