"""Surfaces that cross themselves slightly are meshed, with a warning that says where."""

import pytest

from polycube.cli.infer import _command
from tests.fixtures.runs import config, run, tree


@pytest.mark.slow
@pytest.mark.parametrize(("name", "pairs"), [("rod", 9), ("ring", 26), ("cup", 196)])
def test_a_part_that_crosses_itself_is_meshed_with_a_warning(name, pairs, testdata, tmp_path):
    path = testdata / "bad" / f"real_{name}_ddpm.obj"
    report = run(f"mesh={path}", f"output_dir={tmp_path}", "order=[meshing]", "structure=slices")
    assert report["valid"] and report["hex"]["inverted"] == 0
    assert report["hex"]["min_scaled_jacobian"] > 0.3  # measured .63, .34 and .47
    assert report["hex"]["vertex_off_surface_max"] < 0.005
    [warning] = report["warnings"]
    assert f"surface intersects itself: {pairs} pairs of faces in" in warning and "at (" in warning


def test_one_that_is_open_is_refused(testdata, here, capsys):
    assert _command(config("quiet=true", f"mesh={testdata / 'bad' / 'real_heart_ddpm.obj'}")) == 2
    errors = capsys.readouterr().err
    assert "not closed: 17 edges" in errors and errors.count("\n") == 1
    assert tree(here) == set()
