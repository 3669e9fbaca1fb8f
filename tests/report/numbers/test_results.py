"""Numbers of a run."""

from dataclasses import replace

from polycube.pipeline.state import RunState
from polycube.report.numbers.results import summarize

CONFIG = {"seed": 0, "context": None}


def test_warnings_of_the_mesh_follow_those_of_the_input(run):
    state = RunState(run.surface, path="a.stl", warnings=("crosses itself",), hexes=run.hexes)
    assert summarize(state, {}, {}, CONFIG)["warnings"] == ["crosses itself"]
    hexes = replace(run.hexes, warnings=("not within 0.3 %",))
    found = summarize(replace(state, hexes=hexes), {}, {}, CONFIG)["warnings"]
    assert found == ["crosses itself", "not within 0.3 %"]


def test_a_failure_or_an_early_end_is_told(run):
    state = RunState(run.surface, failure="no mesh", stopped="time was up", interrupted=True)
    report = summarize(state, {"read": 0.1234}, {"read": {}}, CONFIG)
    assert not report["valid"] and report["failure"] == "no mesh"
    assert report["stopped"] == "time was up" and report["interrupted"]
    assert report["seconds"] == {"read": 0.123} and report["effort"] == {}
