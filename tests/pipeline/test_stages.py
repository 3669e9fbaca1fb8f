"""Stages and their clock."""

import numpy as np
import pytest

from polycube.errors import InputError, MeshingError
from polycube.numerics.lbfgs import descend
from polycube.stages import Clock, Stage, meshing_stages
from polycube.state import RunState
from tests.fixtures.stages import TETRAHEDRON, cube


def test_a_stage_takes_and_gives_fields_of_the_state():
    state = RunState(TETRAHEDRON, hexes=cube())
    seen = []

    def plugin(surface, hexes):
        seen.append((surface, hexes))
        return cube(2.0)

    stage = Stage("meshing/smooth", plugin)
    after = stage.put(state, stage(state))
    assert seen == [(TETRAHEDRON, state.hexes)]
    assert after.hexes.vertices.max() == 2 and state.hexes.vertices.max() == 1


def test_a_stage_that_breaks_is_named():
    def broken() -> None:
        raise ZeroDivisionError("by zero")

    with pytest.raises(MeshingError, match="stage meshing/smooth failed: ZeroDivisionError"):
        Clock().run("meshing/smooth", broken)


def test_the_clock_sums_the_effort_of_repeats():
    def bowl() -> np.ndarray:
        return descend(lambda x: (float(x @ x), 2 * x), np.ones(2), 1)

    clock = Clock()
    for name in ("meshing/smooth", "meshing/optimize", "meshing/smooth"):
        clock.run(name, bowl)
    clock.run("spline", lambda: None)
    once = {"steps": 1, "evaluations": 2, "work": 4}  # two coordinates
    twice = {"steps": 2, "evaluations": 4, "work": 8}
    assert clock.effort == {"meshing/smooth": twice, "meshing/optimize": once, "spline": {}}
    assert set(clock.seconds) == set(clock.effort)


def test_an_order_that_is_no_chain_to_a_spline_is_refused():
    with pytest.raises(InputError, match="'meshing/smooth' needs hexes"):
        meshing_stages({"order": ["meshing/smooth"]}, ("surface",))
