"""Stages in sequence: equal plugins with equal inputs run once, options are replaced."""

import threading
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.errors import InputError, MeshingError
from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.crossings import crossings
from polycube.search.chain import (
    NOT_FITTED,
    Chain,
    Deadline,
    check_options,
    merged,
    variants_of,
    with_options,
)
from polycube.stages import Stage
from polycube.state import RunState
from polycube.types import HexMesh, Labels, RoughMap, TriMesh
from tests.fixtures.stages import CALLS, START, TETRAHEDRON, Fill, Grow, Scale, cube, size

OPTIMIZE = "meshing/optimize"


def test_equal_stages_on_equal_inputs_run_once():
    chain = Chain()
    stages = [Stage("meshing/smooth", Scale(2.0)), Stage(OPTIMIZE, Scale(3.0))]
    ends = [chain.run(stages, START, {OPTIMIZE: {"factor": f}}) for f in (3.0, 5.0, 3.0)]
    assert [size(state) for state, _ in ends] == [6, 10, 6]
    assert CALLS == [2.0, 3.0, 5.0]
    assert ends[0][0].hexes is ends[2][0].hexes
    assert size(START) == 1
    smooth, optimize = (ends[1][1][kind] for kind in ("meshing/smooth", OPTIMIZE))
    assert (smooth.vertices.max(), optimize.vertices.max()) == (2, 10)


@settings(deadline=None)
@given(st.lists(st.sampled_from([1.0, 2.0, 4.0]), max_size=8))
def test_a_stage_runs_once_for_each_option_whatever_the_order(factors):
    CALLS.clear()
    chain, stages = Chain(), [Stage("meshing/smooth", Grow(3.0)), Stage(OPTIMIZE, Scale())]
    for factor in factors:
        state, _ = chain.run(stages, START, {OPTIMIZE: {"factor": factor}})
        assert size(state) == 3 * factor
    assert len(CALLS) == len(set(factors)) + bool(factors)


def test_a_stage_that_fails_is_not_run_again():
    chain, stages = Chain(), [Stage(OPTIMIZE, Grow(np.inf))]
    for _ in range(3):
        with pytest.raises(MeshingError, match=r"meshing/optimize failed: ValueError: grown bey"):
            chain.run(stages, START, {})
    assert CALLS == [np.inf]


def test_stages_run_on_other_hexes_again():
    chain, stages = Chain(), [Stage(OPTIMIZE, Scale(2.0))]
    for hexes in (cube(), cube(3.0), cube()):
        chain.run(stages, RunState(TETRAHEDRON, hexes=hexes), {})
    assert CALLS == [2.0, 2.0]  # equal hexes in another object are equal hexes


@dataclass(frozen=True)
class Place:
    at: float = 1.0

    def __call__(self, *_: object) -> RoughMap:
        axes = [np.array([0.0, 1.0])] * 3
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        return RoughMap(*axes, self.at * grid)


def test_a_variant_of_the_map_gets_hexes_of_its_own():
    stages = [Stage("meshing/map", Place()), Stage("meshing/subdivide", Fill())]
    start = RunState(TETRAHEDRON, labels=Labels([0] * 4, [0] * 4))
    chain = Chain()
    sizes = [size(chain.run(stages, start, {"meshing/map": {"at": a}})[0]) for a in (1, 4, 2)]
    assert sizes == [1, 4, 2] and CALLS == [1.0, 4.0, 2.0]


def test_the_latest_mesh_says_whether_it_is_fitted():
    chain = Chain()
    stages = [Stage("meshing/map", Place(2.0)), Stage("meshing/subdivide", Fill())]
    chain.run(stages, RunState(TETRAHEDRON), {})
    assert size(chain.latest) == 2 and chain.latest.unfitted == NOT_FITTED
    chain.run([Stage("meshing/smooth", Grow(3.0))], chain.latest, {})
    assert size(chain.latest) == 3 and chain.latest.unfitted is None


def test_an_interruption_keeps_the_result_of_the_stage_that_was_running():
    interrupt = threading.Event()

    @dataclass(frozen=True)
    class Interrupted(Grow):
        def __call__(self, *given: HexMesh) -> HexMesh:
            interrupt.set()
            return super().__call__(*given)

    chain = Chain(deadline=Deadline(interrupt=interrupt))
    with pytest.raises(KeyboardInterrupt):
        chain.run([Stage("meshing/smooth", Interrupted(5.0)), Stage(OPTIMIZE, Grow())], START, {})
    assert size(chain.latest) == 5 and CALLS == [5.0]


@dataclass(frozen=True)
class Cross:
    """Makes cubes that cross each other."""

    cubes: int = 2

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        CALLS.append(self.cubes)
        one = cube()
        shifts = 0.3 * np.arange(self.cubes)[:, None, None]
        corners = (one.vertices + shifts).reshape(-1, 3)
        numbers = len(one.vertices) * np.arange(self.cubes)[:, None]
        return hex_mesh(corners, one.hexes + numbers)


def test_a_mesh_with_many_crossings_is_not_continued():
    stages = [Stage("meshing/smooth", Cross(3)), Stage(OPTIMIZE, Grow())]
    number = len(crossings(Cross(3)(TETRAHEDRON, cube())))
    CALLS.clear()
    assert number > 0
    with pytest.raises(MeshingError, match=f"hopeless: {number} pairs of quads cross after mesh"):
        Chain(most_crossings=number - 1).run(stages, START, {})
    assert CALLS == [3]
    Chain(most_crossings=number).run(stages, START, {})
    assert CALLS == [3, 3, 1.0]


def test_options_are_merged_and_replaced():
    one, other = {"a": {"x": 1, "y": 2}}, {"a": {"y": 3}, "b": {"z": 4}}
    assert merged(one, other) == {"a": {"x": 1, "y": 3}, "b": {"z": 4}}
    stages = [Stage("meshing/smooth", Scale(2.0)), Stage(OPTIMIZE, Scale(3.0))]
    new = with_options(stages, {OPTIMIZE: {"factor": 7.0}, "meshing/cure": {"of": "another"}})
    assert [stage.plugin for stage in new] == [Scale(2.0), Scale(7.0)]


def test_variants_of_another_plugin_are_refused_or_left_out(caplog):
    caplog.set_level("INFO")
    odd = {OPTIMIZE: {"features": False, "factor": 2.0}}
    stages = [Stage(OPTIMIZE, Scale(3.0))]
    with pytest.raises(InputError, match=r"sets features of meshing/optimize, which Scale does"):
        check_options(stages, {"portfolio": [{}, odd]})
    known = [{OPTIMIZE: {"factor": 2.0}}, {"meshing/cure": {"of": "another"}}]
    check_options(stages, {"portfolio": known, "sweep": [odd]})
    assert "meshing.sweep sets features of meshing/optimize, which Scale" in caplog.text
    assert with_options(stages, odd) == [Stage(OPTIMIZE, Scale(2.0))]


def test_every_list_of_options_by_stage_is_a_list_of_variants():
    more, fewer = {OPTIMIZE: {"factor": 2.0}}, {"meshing/pillow": {"patches": "all"}}
    bundle = {
        "size": "5%",
        "order": [OPTIMIZE],
        "at": [{"at": "hole_1", "around": 16}],
        "portfolio": [{}, more],
        "of_a_stranger": [fewer],
    }
    assert variants_of(bundle) == [{}, more, fewer]
