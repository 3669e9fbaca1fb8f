"""Numbers of a run."""

from dataclasses import replace

from polycube.report.numbers.results import summarize


def test_warnings_of_the_mesh_follow_those_of_the_input(run):
    state = {name: run[name] for name in ("surface", "hexes")} | {"path": "a.stl"}
    state |= {"warnings": ["crosses itself"]}
    assert summarize(state, {}, {}, {"seed": 0})["warnings"] == ["crosses itself"]
    state["hexes"] = replace(state["hexes"], warnings=("not within 0.3 %",))
    found = summarize(state, {}, {}, {"seed": 0})["warnings"]
    assert found == ["crosses itself", "not within 0.3 %"]
