"""Names of the boundary through a run: in the files, in the analysis, refused in time; the gate."""

import logging
import re
import shutil
from dataclasses import replace

import numpy as np
import pytest

from polycube.cli.infer import _command
from polycube.errors import InputError
from polycube.io.vtk import write_hex_vtu
from polycube.pipeline.resume.results import load_stage, save_stage
from tests.fixtures.hexmeshes import hex_box
from tests.fixtures.runs import config, run

FAST = ["improve.optimize.soft_rounds=2", "improve.optimize.hard_rounds=1"]
STAGE = "meshing/optimize"


@pytest.fixture(scope="module")
def block(tmp_path_factory):
    """A block of 3 x 2 x 2 hexes, 30 x 20 x 20, through a run that ends with its mesh."""
    folder = tmp_path_factory.mktemp("block")
    path = write_hex_vtu(folder / "block.vtu", hex_box((3, 2, 2), (30.0, 20.0, 20.0)))
    report = run(f"hex={path}", f"output_dir={folder / 'run'}", "order=[meshing]", *FAST)
    assert report["valid"]
    found = {name: (own["quads"], own["area"]) for name, own in report["hex"]["sets"].items()}
    assert found["x_max"] == (4, pytest.approx(400)) and found["z_min"] == (6, pytest.approx(600))
    return folder / "run"


def resumed(block, output, *overrides):
    return [f"resume={block}", "from=spline", f"output_dir={output}", *FAST, *overrides]


@pytest.mark.slow
def test_the_sets_of_the_files_are_those_of_the_analysis(block, tmp_path):
    given = "analysis.loads=[{at: x_max, traction: [1000, 0, 0]}]"
    held = ["analysis=static", "analysis.fixed=[x_min]", "analysis.gravity=[0,0,0]", given]
    order = "order=[meshing,spline,analysis]"
    found = run(*resumed(block, tmp_path, order, "export=[abaqus]", *held))["static"]
    assert found["load"][0] == pytest.approx(1e3 * 20e-3 * 20e-3)
    text = (tmp_path / "hex.inp").read_text()
    nodes = np.array(
        [line.split(",")[1:] for line in re.findall(r"^\d+,.*\.?.*$", text, re.M)][:36], float
    )
    own = re.search(r"\*NSET, NSET=x_max\n([\d, \n]*)", text)[1]
    assert (nodes[np.array(re.findall(r"\d+", own), int) - 1][:, 0] == 30).all()
    assert "*STATIC\n" in text and "x_min, 1, 1, 0.\n" in text
    forces = re.search(r"\*CLOAD\n([\d, .e\n-]*)", text)[1].splitlines()
    assert sum(float(row.split(", ")[2]) for row in forces) == pytest.approx(found["load"][0])


@pytest.mark.slow
def test_a_deck_is_written_without_solving_and_its_places_are_refused_in_time(
    block, tmp_path, capsys
):
    overrides = ["order=[meshing]", "export=[abaqus]", "from=meshing/optimize"]
    modal = resumed(block, tmp_path / "modal", "analysis.fixed=[x_min]", *overrides)
    assert _command(config(*(entry for entry in modal if entry != "from=spline"))) == 0
    text = (tmp_path / "modal" / "hex.inp").read_text()
    assert "*FREQUENCY\n20\n" in text and "x_min, 3, 3, 0.\n" in text
    bad = resumed(block, tmp_path / "bad", "analysis.fixed=[hole_1]", *overrides)
    bad.remove("from=spline")
    capsys.readouterr()
    assert _command(config(*bad)) == 2
    assert "no boundary set 'hole_1'; there are x_min" in capsys.readouterr().err
    assert not (tmp_path / "bad" / "hex.inp").exists()
    assert _command(config(*bad, "export.abaqus.step=false")) == 0


@pytest.mark.slow
def test_hexes_of_20_nodes_lie_on_the_spline_of_the_run(block, tmp_path):
    order, element = "order=[meshing,spline]", "export.abaqus.element=C3D20"
    assert run(*resumed(block, tmp_path, order, "export=[abaqus,jaxiga]", element))["valid"]
    text = (tmp_path / "run.log").read_text()
    assert "12 hexes of 20 nodes on the spline" in text
    with np.load(tmp_path / "hex.npz") as space, np.load(tmp_path / "spline.npz") as spline:
        np.testing.assert_array_equal(space["cpts"], spline["control"])


@pytest.mark.parametrize("stage", ["spline", "analysis"])
def test_a_name_that_is_not_there_is_refused_before_any_work(block, tmp_path, stage, caplog):
    caplog.set_level(logging.DEBUG, "polycube")
    overrides = resumed(block, tmp_path / "out", "analysis.fixed=[hole_1]")
    with pytest.raises(InputError, match=r"analysis: no boundary set 'hole_1'; there are x_min, x"):
        run(*(f"from={stage}" if entry == "from=spline" else entry for entry in overrides))
    assert not [each for each in caplog.messages if each.startswith(("spline", "analysis"))]


def test_a_name_that_can_not_be_is_refused_before_anything_is_read(tmp_path, capsys):
    code = _command(config("hex=nothing.vtu", "analysis.fixed=[x_mim]", f"output_dir={tmp_path}"))
    assert code == 2 and not list(tmp_path.iterdir())
    assert "a name (x_min to z_max, hole_1, cad_face_1 ...)" in capsys.readouterr().err


@pytest.mark.slow
def test_a_mesh_below_the_limit_has_exit_code_3_and_is_stored(block, tmp_path, capsys):
    overrides = resumed(
        block, tmp_path, "order=[meshing,spline]", "acceptance.least_jacobian=1", "export=[abaqus]"
    )
    assert _command(config(*overrides)) == 0  # a block's hexes are perfect
    mesh = load_stage(block, STAGE)
    bent = mesh.vertices.copy()
    inner = np.setdiff1d(np.arange(len(bent)), mesh.quads)
    bent[inner] += 3
    changed = tmp_path / "changed"
    shutil.copytree(block, changed)
    save_stage(changed, STAGE, replace(mesh, vertices=bent))
    overrides = resumed(changed, tmp_path / "bent", *overrides[-3:])
    assert _command(config(*overrides)) == 3
    assert "must be 1 or more; the files are marked as" in capsys.readouterr().err
    text = (tmp_path / "bent" / "hex.inp").read_text()
    assert "add material, section and step" in text and "*STEP" not in text
    for bad in ("2", "true", "high"):
        assert _command(config(*overrides, f"acceptance.least_jacobian={bad}")) == 2


def test_an_inverted_mesh_is_marked_and_not_exported(block, tmp_path, capsys):
    mesh = load_stage(block, STAGE)
    folded = mesh.vertices.copy()
    folded[np.setdiff1d(np.arange(len(folded)), mesh.quads)] += 30
    changed = tmp_path / "changed"
    shutil.copytree(block, changed)
    save_stage(changed, STAGE, replace(mesh, vertices=folded))
    overrides = resumed(
        changed, tmp_path / "folded", "order=[meshing,spline]", "export=[abaqus,gmsh]"
    )
    assert _command(config(*overrides)) == 3
    assert "must be above 0; the files are marked as invalid" in capsys.readouterr().err
    files = {path.name for path in (tmp_path / "folded").iterdir()}
    assert {"hex.vtu", "report.json"} <= files and not {"hex.inp", "hex.msh"} & files
