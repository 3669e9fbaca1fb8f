"""Numbers of hexes at faces of a part, from the command line to the report."""

import pytest

from polycube.cli.infer import _command
from polycube.io.vtk import write_hex_vtu
from tests.fixtures import cad_parts
from tests.fixtures.hexmeshes import hex_box
from tests.fixtures.runs import config, run

QUICK = ["improve.optimize.soft_rounds=2", "improve.optimize.hard_rounds=1"]
FAST = ["structure=labels", "order=[meshing]"]


def counts(tmp_path, name, at, *overrides):
    """What the report says of the entries, and the number of hexes."""
    path = cad_parts.write(name, tmp_path)
    given = [f"mesh={path}", f"output_dir={tmp_path / 'run'}", *FAST, f"meshing.at={at}"]
    report = run(*given, *overrides)
    return {row["at"]: row["reached"] for row in report["hex"]["counts"]["at"]}, report


@pytest.mark.slow
def test_three_hexes_through_the_web_of_a_beam(tmp_path):
    reached, report = counts(tmp_path, "i_beam", "[{at: cad_face_7, through: 3}]")
    assert reached == {"cad_face_7": 3}
    assert report["valid"] and report["hex"]["hexes"] < 1000  # 768 without
    assert report["hex"]["features"]["lost"] == []


@pytest.mark.slow
def test_sixteen_edges_round_one_hole_of_a_plate(tmp_path):
    reached, report = counts(tmp_path, "plate", "[{at: hole_1, around: 16}]")
    assert reached == {"hole_1": 16}
    assert report["valid"] and report["hex"]["hexes"] < 1500  # 1,168 without
    assert report["mesh_warnings"] == [] and report["hex"]["counts"]["fewer"] == []


@pytest.mark.slow
def test_a_request_that_max_hexes_forbids_gives_a_warning(tmp_path):
    at = "[{at: hole_1, around: 40}]"
    reached, report = counts(tmp_path, "plate", at, "meshing.max_hexes=1500")
    assert 8 < reached["hole_1"] < 40
    [warning] = report["mesh_warnings"]
    assert (
        warning.startswith("meshing.at: the mesh has") and "round hole_1 instead of 40" in warning
    )


def test_an_unknown_face_is_refused_before_anything_is_written(tmp_path, capsys):
    overrides = ["mesh=example:rod", *FAST, f"output_dir={tmp_path / 'out'}"]
    assert _command(config(*overrides, "meshing.at=[{at: hole_99, around: 8}]")) == 2
    assert "meshing.at: the part has no face or hole 'hole_99'" in capsys.readouterr().err
    assert _command(config(*overrides, "meshing.at=[{at: hole_1, round: 8}]")) == 2
    assert "must have around, through or size; got 'round' at hole_1" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_entries_are_also_checked_for_a_given_hex_mesh(tmp_path, capsys):
    path = write_hex_vtu(tmp_path / "box.vtu", hex_box((4, 3, 2), (4.0, 3.0, 2.0)))
    overrides = [f"hex={path}", "order=[meshing]", f"output_dir={tmp_path / 'out'}"]
    assert _command(config(*overrides, "meshing.at=[{at: z_max, depth: 1}]")) == 2
    assert "meshing.at: an entry of at must have around" in capsys.readouterr().err
    assert _command(config(*overrides, "meshing.at=[{at: hole_1, through: 1}]")) == 2
    report = run(*overrides, *QUICK, "meshing.at=[{at: z_max, through: 3}]")
    assert report["hex"]["counts"]["at"][0]["reached"] == 2
    assert report["mesh_warnings"] == [
        "meshing.at: the mesh has 2 hexes through the wall at z_max instead of 3"
    ]
