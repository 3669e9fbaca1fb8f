"""The program as a user meets it: one part all the way, refusals, resume, overrides."""

import csv
import json
import shutil
import subprocess
import sys
from pathlib import Path

import meshio
import numpy as np
import pytest
from omegaconf import OmegaConf

from polycube import HOME
from polycube.cli.infer import _command
from polycube.errors import InputError
from polycube.io.manifest import writing
from tests.conftest import first_quick
from tests.fixtures.runs import FAST, config, run, tree


@pytest.fixture(scope="module")
def rod(tmp_path_factory) -> tuple[dict, Path]:
    folder = tmp_path_factory.mktemp("rod")
    return run(
        "mesh=example:rod", f"output_dir={folder}", "analysis.modes=10", "export=[vtk]", *FAST
    ), folder


@pytest.mark.slow
def test_one_part_all_the_way(rod):
    report, folder = rod
    assert report["valid"]
    assert report["polycube"]["genus"] == report["input"]["genus"] == 1
    assert report["hex"]["inverted"] == 0
    assert report["hex"]["min_scaled_jacobian"] > 0.2
    assert report["spline"]["min_detj"] > 0
    assert {"ranking", "meshing/smooth", "meshing/optimize"} <= set(report["effort"])
    assert all(0 < spent["steps"] < spent["evaluations"] for spent in report["effort"].values())
    assert report == json.loads((folder / "report.json").read_text())
    files = {"polycube.vtu", "labels.vtp", "hex.vtu", "spline.bext", "spline.vtu", "modes.vtu"}
    files |= {
        "modes.csv",
        "report.html",
        "report.json",
        "config.json",
        "run.log",
        "hex.vtk",
        "spline.npz",
    }
    assert files <= tree(folder)
    assert not [name for name in tree(folder) if name.endswith((".tmp", ".partial"))]


@pytest.mark.slow
def test_volumes_of_part_mesh_and_spline(rod):
    report, folder = rod
    part, mesh, spline = (report[name]["volume"] for name in ("input", "hex", "spline"))
    assert mesh == pytest.approx(part, rel=0.03)
    assert spline == pytest.approx(part, rel=0.005)  # fitted to the part, nearer than the mesh
    assert abs(spline - part) < 0.2 * abs(mesh - part)
    with np.load(folder / "spline.npz") as arrays:
        assert len(arrays["nodes"]) == report["spline"]["elements"]
        assert len(arrays["control"]) == report["spline"]["functions"]


@pytest.mark.slow
def test_six_rigid_modes_and_then_elastic_ones(rod):
    report, folder = rod
    omega_squared = np.array(report["modes"]["omega_squared"])
    assert np.abs(omega_squared[:6]).max() < 1e-8 * omega_squared[6]
    rows = list(csv.DictReader((folder / "modes.csv").open()))
    assert [float(r["frequency_hz"]) for r in rows] == report["modes"]["frequency_hz"]


@pytest.mark.slow
def test_resume_goes_on_from_the_stage_named(rod, tmp_path):
    first, folder = rod
    resumed = run(
        f"resume={folder}", "from=analysis", f"output_dir={tmp_path}", "analysis.modes=8", *FAST
    )
    assert resumed["hex"] == first["hex"]
    values = first["modes"]["omega_squared"][:8]  # the first six are noise compared with the others
    assert resumed["modes"]["omega_squared"] == pytest.approx(
        values, rel=1e-6, abs=1e-9 * values[6]
    )
    assert "meshing/optimize" not in resumed["seconds"]


@pytest.mark.slow
def test_files_are_written_as_requested(rod, tmp_path):
    options = ("files.bext=2", "files.cells=corners", "files.precision=double")
    half = "order=[meshing,spline,analysis]"
    run(f"resume={rod[1]}", "from=analysis", f"output_dir={tmp_path}", half, *options, *FAST)
    assert "spline.bxt" in tree(tmp_path) and "spline.bext" not in tree(tmp_path)
    assert "spline.bxt" in (tmp_path / "modal.k").read_text().splitlines()
    modes = meshio.read(tmp_path / "modes.vtu")
    assert [block.type for block in modes.cells] == ["hexahedron"]
    assert {array.dtype for array in modes.point_data.values()} == {np.dtype(np.float64)}
    with pytest.raises(InputError, match=r"files\.bext must be one of auto, 1, 2, both; got 3"):
        run("mesh=example:rod", "files.bext=3", f"output_dir={tmp_path / 'b'}")


@pytest.mark.slow
def test_a_resumed_run_says_which_settings_are_others_and_leaves_no_old_results(
    rod, tmp_path, caplog
):
    folder = tmp_path / "rod"
    shutil.copytree(rod[1], folder)
    with writing(folder) as scratch:
        for name in ("poisson.vtu", "hex.inp"):
            (scratch / name).write_text("of an earlier run")
    run(f"resume={folder}", "from=analysis", "analysis=static", *FAST)
    warnings = [m for m in caplog.messages if "resumed with other settings" in m]
    assert any("analysis.plugin is static, was modal" in m for m in warnings)
    assert any("analysis.fixed is ['z_min'], was []" in m for m in warnings)
    assert not any("meshing" in m for m in warnings)
    assert (folder / "static.vtu").is_file() and (folder / "spline.bext").is_file()
    assert not {"poisson.vtu", "hex.inp", "modes.vtu", "modes.csv"} & tree(folder)


@pytest.mark.slow
def test_units_and_placement_are_kept(rod, tmp_path):
    import trimesh

    from polycube.examples.parts import example

    surface = example("rod")
    shift = np.array([5e3, -2e3, 1e3])
    moved = trimesh.Trimesh(1000 * surface.vertices + shift, surface.faces, process=False)
    moved.export(tmp_path / "moved.ply")
    report = run(f"mesh={tmp_path / 'moved.ply'}", f"output_dir={tmp_path / 'out'}", *FAST)
    low, _ = np.array(report["input"]["bbox"])
    assert low == pytest.approx(1000 * surface.vertices.min(0) + shift, rel=1e-5)
    first = rod[0]["hex"]
    assert report["hex"]["min_scaled_jacobian"] == pytest.approx(
        first["min_scaled_jacobian"], abs=0.1
    )
    assert report["spline"]["volume"] == pytest.approx(1e9 * rod[0]["spline"]["volume"], rel=0.02)


@pytest.mark.slow
def test_a_given_context_is_used(tmp_path):
    report = run(
        "mesh=example:rod",
        "context=[cube,hole_y]",
        f"output_dir={tmp_path}",
        FAST[0],
        "structure=given",
    )
    assert report["polycube"]["context"] == ["cube", "hole_y"]
    assert not report["polycube"]["auto"]
    assert report["valid"]


@pytest.mark.parametrize(
    ("overrides", "sentence"),
    first_quick(
        3,
        [
            (["mesh=nowhere.stl"], "nowhere.stl"),
            (
                ["mesh=nowhere.stl", "output_dir=/proc/nowhere"],
                "cannot write results to /proc/nowhere",
            ),
            (["mesh=example:nothing"], "rod"),
            (["mesh=example:rod", "structure=given", "context=[cube,cube]"], "genus"),
            (["mesh=example:rod", "structure=given", "context=[cube,cone]"], "cone"),
            (["mesh=example:rod", "spline.plugin=nurbs"], "h2s"),
            (["mesh=example:rod", "export=[abaqus]", "export.abaqus.element=C4"], "C3D8"),
            (["mesh=example:rod", "meshing.order=[meshing/smooth]"], "needs hexes"),
            (["mesh=example:rod", "resume=nowhere", "from=spline"], "contains no result"),
            (["mesh=example:rod", "meshing.order=[]"], "meshing/subdivide before it"),
            (
                ["meshing.order=[meshing/segment,meshing/map,meshing/subdivide]", "mesh=a.stl"],
                "no config for stage 'meshing/segment'; have meshing/subdivide",
            ),
            (["mesh=example:rod", "order=[mesh]"], "got ['mesh']"),
            (["mesh=example:rod", "order=mesh"], "order must be a list"),
            (["mesh=example:rod", "order=[meshing,analysis]"], "[meshing, spline, analysis]"),
            (["mesh=example:ring", "structure=sweep"], "verbose=true shows the reasons"),
            (
                ["mesh=example:rod", "effort=some"],
                "effort must be one of first, normal, thorough; got 'some'",
            ),
            (["mesh=example:rod", "seed=x"], "seed must be a whole number, 0 or more; got 'x'"),
            (["mesh=example:rod", "quiet=maybe"], "quiet must be true or false; got 'maybe'"),
            (["mesh=example:rod", "meshing.size=fine"], "size must be a positive number"),
            (["mesh=example:rod", "meshing.size=-5%"], "got '-5%'"),
            (["mesh=example:rod", "meshing.level=many"], "level must be null or a whole number"),
            (
                ["mesh=example:rod", "meshing.deviation=0"],
                "deviation must be null or a positive number",
            ),
            (
                ["mesh=example:rod", "meshing.creases=near"],
                "creases must be null or a positive number",
            ),
            (["mesh=example:rod", "meshing.max_hexes=1e5"], "max_hexes must be a whole number"),
            (["mesh=example:rod", "meshing.regions=[{box:[1,2],size:1}]"], "a region is"),
            (["resume=nowhere"], "from=STAGE"),
            ([], "infer.py part.step"),
        ],
    ),
)
def test_refusals_are_one_sentence_with_code_2_and_no_files(overrides, sentence, here, capsys):
    assert _command(config("quiet=true", "structure=slices", *overrides)) == 2
    errors = capsys.readouterr().err
    assert errors.startswith("error: ") and errors.count("\n") == 1
    assert sentence in errors
    assert tree(here) == set()


@pytest.mark.slow
def test_the_name_of_a_file_alone_is_the_mesh(tmp_path):
    (tmp_path / "part.stl").touch()
    command = [sys.executable, str(HOME / "infer.py"), "part.stl"]
    ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert ended.returncode == 2 and "error: part.stl: the file is empty" in ended.stderr


@pytest.mark.slow
def test_command_line_exit_codes(tmp_path):
    command = [sys.executable, str(HOME / "infer.py")]
    for override in ("mesh=nowhere.stl", "no_such_option=1"):
        ended = subprocess.run([*command, override], cwd=tmp_path, capture_output=True, text=True)
        assert ended.returncode == 2
        assert "Traceback" not in ended.stderr
    assert tree(tmp_path) == set()


@pytest.mark.slow
def test_a_context_is_the_only_one_that_is_ranked(tmp_path):
    report = run(
        "mesh=example:rod",
        "context=[cube,hole_z]",
        "structure=given",
        f"output_dir={tmp_path}",
        "order=[]",
    )
    found = report["polycube"]["candidates"]
    assert found and {tuple(entry["context"]) for entry in found} == {("cube", "hole_z")}


@pytest.mark.slow
def test_a_new_run_leaves_no_results_of_another_in_the_folder(tmp_path):
    old = {"hex.vtu", "hex.inp", "report.html", "modes.csv", "stages/spline.npz"}
    with writing(tmp_path) as scratch:
        (scratch / "stages").mkdir()
        for name in old:
            (scratch / name).write_text("of another part")
    (tmp_path / "hex.k").write_text("of the user")
    (tmp_path / "modes.csv").write_text("changed by the user")
    for _ in range(2):
        run("mesh=example:dice", f"output_dir={tmp_path}", "order=[]", "structure=slices")
        files = tree(tmp_path)
        assert {"hex.k", "modes.csv", "report.json", "stages/read.npz"} <= files
        assert not (old - {"modes.csv"}) & files


def test_a_folder_that_can_not_be_written_is_refused(tmp_path, capsys):
    (tmp_path / "run.log").mkdir()
    overrides = ("mesh=example:dice", f"output_dir={tmp_path}", "structure=slices", "quiet=true")
    assert _command(config(*overrides)) == 2
    (tmp_path / "file").touch()
    assert _command(config(*overrides, f"output_dir={tmp_path / 'file'}")) == 2
    errors = capsys.readouterr().err.splitlines()
    assert len(errors) == 2
    assert "run.log would be overwritten" in errors[0] and "cannot write results to" in errors[1]


@pytest.mark.slow
def test_help_shows_how_to_begin():
    command = [sys.executable, str(HOME / "infer.py"), "--help"]
    ended = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "python infer.py mesh=part.stl" in ended.stdout


def test_the_seed_of_the_run_is_that_of_the_denoising():
    cfg = OmegaConf.to_container(config("mesh=example:rod", "seed=7"), resolve=True)
    assert cfg["structure"]["proposals"]["diffusion"]["seed"] == 7
    alone = config("mesh=example:rod", "seed=7", "structure=diffusion")
    assert OmegaConf.to_container(alone, resolve=True)["structure"]["seed"] == 7
