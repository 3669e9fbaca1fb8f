"""Stages and their clock."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import pytest

from polycube.errors import InputError, MeshingError
from polycube.numerics.lbfgs import descend
from polycube.pipeline.resume.results import StageResults
from polycube.pipeline.solving import solved
from polycube.registry import BY_RUN
from polycube.spline.spaces.extraction import volumetric_spline
from polycube.spline.spaces.sharpness import NO_EDGES
from polycube.stages import Clock, Stage, meshing_stages
from polycube.state import RunState
from polycube.types import Modes, Spline
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


def test_the_clock_leaves_a_step_in_a_step_to_itself():
    clock = Clock()
    clock.run("spline", lambda: clock.run("analysis", partial(time.sleep, 0.02)))
    assert clock.seconds["spline"] < 0.02 <= clock.seconds["analysis"]


@dataclass(frozen=True)
class ByItsModes:
    """A spline that is chosen by the modes on it, which it hands on if it is asked to."""

    hands_on: bool
    analysis: Callable = field(default=None, metadata=BY_RUN)

    def __call__(self, surface, hexes) -> Spline | tuple[Spline, Modes]:
        spline = volumetric_spline(hexes, NO_EDGES)
        modes = self.analysis(spline)
        return (spline, modes) if self.hands_on else spline


@pytest.mark.parametrize("hands_on", [True, False])
def test_the_solution_that_chose_the_spline_is_that_of_the_run(hands_on):
    found = []

    def modal(spline: Spline) -> Modes:
        found.append(Modes(np.zeros(1), np.zeros((1, len(spline.control), 3)), 1.0))
        return found[-1]

    clock, stages = Clock(), [Stage("spline", ByItsModes(hands_on)), Stage("analysis", modal)]
    state = solved(RunState(TETRAHEDRON, hexes=cube()), stages, clock, StageResults())
    assert len(found) == 2 - hands_on and state.solution is found[-1]
    assert len(state.spline.control) == 8
    assert set(clock.seconds) == {"spline", "analysis"}


def test_an_order_that_is_no_chain_to_a_spline_is_refused():
    with pytest.raises(InputError, match="'meshing/smooth' needs hexes"):
        meshing_stages({"order": ["meshing/smooth"]}, ("surface",))
