"""How far a run goes."""

import pytest

import polycube
from polycube.config import compose
from polycube.pipeline.settings import Settings
from tests.fixtures.surfaces import box

ALL = ("meshing", "spline", "analysis", "report")


@pytest.mark.parametrize(
    ("overrides", "order"),
    [
        ([], ALL),
        (["order=meshing"], ("meshing",)),
        (["spline=none"], ("meshing", "report")),
        (["analysis=none"], ("meshing", "spline", "report")),
        (["spline=none", "analysis=static"], ("meshing", "report")),
        (["spline=none", "order=[meshing,spline]"], ("meshing",)),
        (["analysis=none", "order=[report]"], ("report",)),
    ],
)
def test_none_leaves_a_part_of_the_run_out_and_all_that_needs_it(overrides, order) -> None:
    assert Settings.of(compose("infer", ["mesh=part.step", *overrides])).order == order


@pytest.mark.slow
def test_a_mesh_without_spline_and_analysis(tmp_path) -> None:
    fast = {"size": "20%", "structure": "slices", "spline": "none", "analysis": "none"}
    made = polycube.mesh(box(), **fast)
    assert made.spline is made.solution is made.problem is None
    made.save(tmp_path / "box.inp")
    assert "*STEP" not in (tmp_path / "box.inp").read_text()
