"""Numbers of a run."""

from dataclasses import replace
from datetime import datetime

from polycube.report.numbers.results import summarize
from polycube.report.numbers.verdict import about
from polycube.state import RunState

CONFIG = {"seed": 0, "context": None}


def test_warnings_of_the_mesh_follow_those_of_the_input(run):
    state = RunState(run.surface, path="a.stl", warnings=("crosses itself",), hexes=run.hexes)
    assert summarize(state, {}, {}, CONFIG)["warnings"] == ["crosses itself"]
    hexes = replace(run.hexes, warnings=("not within 0.3 %",))
    found = summarize(replace(state, hexes=hexes), {}, {}, CONFIG)["warnings"]
    assert found == ["crosses itself", "not within 0.3 %"]


def test_a_failure_or_an_early_end_is_reported(run):
    state = RunState(run.surface, failure="no mesh", stopped="time was up", interrupted=True)
    report = summarize(state, {"read": 0.1234}, {"read": {}}, CONFIG)
    assert not report["valid"] and report["failure"] == "no mesh"
    assert report["stopped"] == "time was up" and report["interrupted"]
    assert report["seconds"] == {"read": 0.123} and report["effort"] == {}


def test_the_report_says_when_and_where_it_was_made(run):
    made = summarize(RunState(run.surface), {}, {}, CONFIG)["made"]
    assert datetime.fromisoformat(made["date"]).utcoffset() is not None
    assert "processors" in made["machine"]
    found = about({"made": {"date": "2026-01-31T12:34:56+01:00"}, "input": {"path": "a.stl"}})
    assert found["date"] == "2026-01-31 12:34 +01:00" and found["length unit"] == "unknown"
    config = {"analysis": {"units": "cm"}}
    box = {"path": "a.STEP", "unit": "cm", "bbox": [[0, 0, 1], [2, 3, 5]]}
    assert about({"config": config, "input": box})["size"] == "2 × 3 × 4 cm"
    assert about({"config": config, "input": box})["length unit"] == "cm, by the file"
    found = about({"config": config, "input": {"path": "a.stl"}})["length unit"]
    assert found == "cm, by analysis.units; the file is without a unit"
