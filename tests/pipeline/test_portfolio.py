"""Variants and starts on small made-up stages."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycube.errors import InputError, MeshingError
from polycube.pipeline import ahead
from polycube.pipeline.portfolio import Portfolio, run_portfolio, search
from polycube.pipeline.stages import Clock, Stage
from polycube.types import HexMesh, TriMesh
from tests.pipeline.test_pipeline import cube


@pytest.fixture(autouse=True)
def one_core(monkeypatch):
    """Only what is asked for is run."""
    monkeypatch.setattr(ahead, "cores", lambda: 1)


@dataclass(frozen=True)
class Scale:
    factor: float = 1.0

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        CALLS.append(self.factor)
        if self.factor == np.inf:
            raise ValueError("factor inf")
        return HexMesh(
            self.factor * hexes.vertices, hexes.hexes, hexes.quads, hexes.patch, hexes.cell
        )


CALLS: list[float] = []


def test_portfolio_keeps_the_best_and_runs_equal_work_once():
    CALLS.clear()
    stages = [Stage("meshing/smooth", Scale(2.0)), Stage("meshing/optimize", Scale(3.0))]
    portfolio = [{"meshing/optimize": {"factor": f}} for f in (3.0, 5.0, 3.0)]
    state = {"surface": None, "hexes": cube()}
    end, path = run_portfolio(
        stages, portfolio, state, Clock(), lambda s: -abs(s["hexes"].vertices.max() - 9)
    )
    assert end["hexes"].vertices.max() == 10
    assert [mesh.vertices.max() for mesh in path] == [2, 10]
    assert CALLS == [2.0, 3.0, 5.0]
    assert state["hexes"].vertices.max() == 1


@dataclass(frozen=True)
class Place:
    at: float = 1.0

    def __call__(self, *_: object) -> float:
        return self.at


@dataclass(frozen=True)
class Fill:
    def __call__(self, surface: None, polycube: None, rough_map: float) -> HexMesh:
        CALLS.append(rough_map)
        return cube(rough_map)


def test_a_variant_of_the_map_gets_hexes_of_its_own():
    CALLS.clear()
    stages = [Stage("meshing/map", Place()), Stage("meshing/subdivide", Fill())]
    portfolio = [{"meshing/map": {"at": at}} for at in (1.0, 4.0, 2.0, 4.0)]
    names = ("surface", "polycube", "labels", "parametrization", "rough_map")
    end, path = run_portfolio(
        stages, portfolio, dict.fromkeys(names), Clock(), lambda s: s["hexes"].vertices.max()
    )
    assert end["hexes"].vertices.max() == 4 and path[0] == 4
    assert CALLS == [1.0, 4.0, 2.0]


def test_a_kind_that_runs_once_runs_on_the_best():
    CALLS.clear()
    stages = [Stage("meshing/optimize", Scale(1.0)), Stage("meshing/refine", Scale(7.0))]
    portfolio = [{"meshing/optimize": {"factor": f}} for f in (2.0, 5.0, 3.0)]
    state = {"surface": None, "hexes": cube()}
    end, path = run_portfolio(
        stages, portfolio, state, Clock(), lambda s: s["hexes"].vertices.max()
    )
    assert CALLS == [2.0, 5.0, 3.0, 7.0]
    assert [mesh.vertices.max() for mesh in path] == [5, 35]
    assert end["hexes"].vertices.max() == 35
    end, path = run_portfolio(stages[1:], portfolio, state, Clock(), lambda s: 0.0)
    assert [mesh.vertices.max() for mesh in path] == [7]


def test_portfolio_ends_with_what_is_good_enough():
    CALLS.clear()
    stages = [Stage("meshing/optimize", Scale(3.0))]
    portfolio = [{"meshing/optimize": {"factor": f}} for f in (3.0, 5.0, 9.0)]
    state = {"surface": None, "hexes": cube()}
    end, _ = run_portfolio(
        stages, portfolio, state, Clock(), lambda s: s["hexes"].vertices.max(), enough=5.0
    )
    assert end["hexes"].vertices.max() == 5
    assert CALLS == [3.0, 5.0]


@dataclass(frozen=True)
class Grow:
    """Adds to the size: by less in a short run."""

    to: float = 1.0
    short: bool = False

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        CALLS.append((self.to, self.short))
        if self.to == np.inf:
            raise ValueError("grown beyond all bounds")
        return cube(self.to / (2 if self.short else 1))


TRIAL = {"meshing/optimize": {"short": True}}


def size(state) -> float:
    """The score: of the hexes of a state."""
    return state["hexes"].vertices.max()


def searched(*starts: list[float], enough: float, settled: float = np.inf, has_rival: bool = False):
    """Size that a search ends with, and the runs it took after the first."""
    CALLS.clear()
    stages = [Stage("meshing/optimize", Grow())]

    def portfolios():
        for sizes in starts:
            variants = [{"meshing/optimize": {"to": to}} for to in sizes]
            state = {"surface": None, "hexes": cube()}
            yield Portfolio(stages, variants, state, Clock(), size, TRIAL)

    found = search(portfolios(), enough, lambda tried: tried.best >= settled, has_rival)
    end, path = found.result()
    assert path == [end["hexes"]] and found.best == size(end)
    return size(end), CALLS[1:]


@pytest.mark.parametrize(
    ("sizes", "enough", "expected", "calls"),
    [
        ([6.0, 9.0], 5.0, 6.0, []),  # the first is enough
        ([2.0, 3.0, 8.0, 4.0], 9.0, 8.0, [(2, True), (3, True), (8, True), (4, True), (8, False)]),
        ([2.0, 3.0, 8.0, 7.0], 4.0, 4.0, [(2, True), (3, True), (8, True)]),  # a trial is enough
        ([9.0, 2.0], 10.0, 9.0, [(9, True), (2, True), (2, False)]),  # the best of the others
        ([np.inf, 2.0, 4.0], 9.0, 4.0, [(np.inf, True), (2, True), (4, True), (4, False)]),
        ([2.0], 9.0, 2.0, [(2, True)]),  # nothing to choose from
    ],
)
def test_of_the_others_only_the_best_in_a_trial_is_run_in_full(sizes, enough, expected, calls):
    assert searched(sizes, enough=enough) == (expected, calls)


@pytest.mark.parametrize(
    ("settled", "has_rival", "expected", "calls"),
    [
        (3.0, False, 4.0, [(3, True), (4, True), (4, False)]),  # no other start is looked at
        (9.0, False, 9.0, [(3, True), (4, True), (7, True), (9, True), (9, False)]),
        (9.0, True, 9.0, [(7, True), (9, True), (9, False)]),  # the rival comes first
    ],
)
def test_another_start_goes_on_where_its_first_trial_is_better(settled, has_rival, expected, calls):
    found = searched([3.0, 4.0], [7.0, 9.0], enough=20, settled=settled, has_rival=has_rival)
    assert found == (expected, calls)


def test_a_start_whose_first_trial_is_worse_has_no_other_run():
    assert searched([3.0, 4.0], [2.0, 9.0], enough=20) == (
        4.0,
        [(3, True), (4, True), (2, True), (4, False)],
    )
    assert searched([3.0, 4.0], [2.0, 9.0], enough=20, has_rival=True) == (
        4.0,
        [(2, True), (3, True), (4, True), (4, False)],
    )


@given(st.lists(st.floats(1, 100), min_size=1, max_size=6), st.floats(1, 100))
def test_trials_that_rank_right_lose_nothing(sizes, enough):
    found, calls = searched(sizes, enough=enough)
    assert found == max(sizes) or found >= enough
    assert sum(not short for _, short in calls) <= 1


@dataclass(frozen=True)
class Refuse:
    def __call__(self, *_: object) -> float:
        CALLS.append("refused")
        raise MeshingError("no map")


def test_a_stage_that_no_variant_changes_fails_once_for_all():
    CALLS.clear()
    stages = [Stage("meshing/map", Refuse()), Stage("meshing/optimize", Grow())]
    names = ("surface", "polycube", "labels", "parametrization", "rough_map", "hexes")
    portfolio = Portfolio(stages, [{}, {}], dict.fromkeys(names), Clock(), size, TRIAL)
    with pytest.raises(MeshingError, match="no map"):
        search([portfolio], 5.0, lambda _: False).result()
    assert CALLS == ["refused"]


def test_portfolio_passes_over_a_variant_that_fails_unless_all_do():
    stages = [Stage("meshing/optimize", Scale(1.0))]
    portfolio = [{"meshing/optimize": {"factor": f}} for f in (np.inf, 2.0)]
    state = {"surface": None, "hexes": cube()}

    def score(end):
        return end["hexes"].vertices.max()

    end, _ = run_portfolio(stages, portfolio, state, Clock(), score)
    assert end["hexes"].vertices.max() == 2
    with pytest.raises(MeshingError, match="factor inf"):
        run_portfolio(stages, portfolio[:1], state, Clock(), score)


@pytest.mark.parametrize("where", ["variants", "trial"])
def test_variants_of_another_plugin_are_refused(where):
    odd = {"meshing/optimize": {"features": False, "factor": 2.0}}
    chosen = {"variants": [{}, odd]} if where == "variants" else {"variants": [{}], "trial": odd}
    stages = [Stage("meshing/optimize", Scale(3.0))]
    with pytest.raises(InputError, match=r"sets features of meshing/optimize, which Scale does"):
        Portfolio(stages=stages, state={}, clock=Clock(), score=lambda state: 0.0, **chosen)
