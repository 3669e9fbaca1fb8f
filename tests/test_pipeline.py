"""The chain check, the portfolio and the artifacts, on small made-up stages."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_matrix

from polycube import artifacts
from polycube.errors import InputError, MeshingError
from polycube.geometry.descent import descend
from polycube.kinds import check_chain
from polycube.pipeline import Clock, Stage, load_stage, run_portfolio, save_stage
from polycube.types import HexMesh, Spline, TriMesh

CUBE = np.array(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij")).reshape(3, -1).T[:, ::-1]


def cube(scale: float = 1.0) -> HexMesh:
    corners = [[0, 1, 3, 2, 4, 5, 7, 6]]
    return HexMesh(scale * CUBE, corners, np.zeros((0, 4)), np.zeros(0), [0])


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


def test_a_stage_without_its_input_is_named_with_the_remedy():
    with pytest.raises(InputError, match=r"'meshing/smooth' needs hexes.*put meshing/subdivide"):
        check_chain(["meshing/smooth"], {"surface"})


def test_a_stage_that_is_none_is_named():
    with pytest.raises(InputError, match="'schedule' is no stage; the stages are structure"):
        check_chain(["schedule"], {"surface"})


def test_the_natural_order_is_a_chain():
    order = ["meshing/segment", "meshing/subdivide", "meshing/smooth", "meshing/pillow"]
    have = {"surface", "polycube", "rough_map", "parametrization"}
    check_chain([*order, "meshing/optimize", "spline", "analysis"], have)


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


def raced(sizes: list[float], enough: float) -> tuple[float, list]:
    """Size that a portfolio with trials ends with, and the runs it took after the first."""
    CALLS.clear()
    stages = [Stage("meshing/optimize", Grow())]
    portfolio = [{"meshing/optimize": {"to": size}} for size in sizes]
    state = {"surface": None, "hexes": cube()}
    size = lambda s: s["hexes"].vertices.max()  # noqa: E731
    end, path = run_portfolio(stages, portfolio, state, Clock(), size, enough, TRIAL)
    assert path == [end["hexes"]]
    return size(end), CALLS[1:]


@pytest.mark.parametrize(
    ("sizes", "enough", "expected", "calls"),
    [
        ([6.0, 9.0], 5.0, 6.0, []),  # the first is enough
        ([2.0, 3.0, 8.0, 4.0], 9.0, 8.0, [(2, True), (3, True), (8, True), (4, True), (8, False)]),
        ([2.0, 3.0, 8.0], 4.0, 4.0, [(2, True), (3, True), (8, True)]),  # a trial is enough
        ([9.0, 2.0], 10.0, 9.0, [(9, True), (2, True), (2, False)]),  # the best of the others
        ([np.inf, 2.0, 4.0], 9.0, 4.0, [(np.inf, True), (2, True), (4, True), (4, False)]),
        ([2.0], 9.0, 2.0, []),  # nothing to choose from
    ],
)
def test_of_the_others_only_the_best_in_a_trial_is_run_in_full(sizes, enough, expected, calls):
    assert raced(sizes, enough) == (expected, calls)


@given(st.lists(st.floats(1, 100), min_size=1, max_size=6), st.floats(1, 100))
def test_trials_that_rank_right_lose_nothing(sizes, enough):
    size, calls = raced(sizes, enough)
    assert size == max(sizes) or size >= enough
    assert sum(not short for _, short in calls) <= 1


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
    once = {"steps": 1, "evaluations": 2}
    twice = {"steps": 2, "evaluations": 4}
    assert clock.effort == {"meshing/smooth": twice, "meshing/optimize": once, "spline": {}}
    assert set(clock.seconds) == set(clock.effort)


def test_stage_results_come_back(tmp_path):
    save_stage(tmp_path, "meshing/smooth", cube(2.0))
    back = load_stage(tmp_path, "meshing/smooth")
    assert isinstance(back, HexMesh)
    assert (back.vertices == 2.0 * CUBE).all()
    with pytest.raises(InputError, match=r"no result of stage 'spline'; it holds meshing/smooth"):
        load_stage(tmp_path, "spline")


def test_artifacts_keep_every_kind_of_value(tmp_path):
    extraction = csr_matrix(np.eye(3)[[0, 1, 1]])
    spline = Spline(np.eye(3), extraction, np.zeros((1, 64)), [0], [1], [[0, 5]], [3], 4)
    value = [spline, ("cube", None), {"a": 1.5}, np.arange(3)]
    artifacts.save(tmp_path / "value.npz", value)
    back = artifacts.load(tmp_path / "value.npz")
    assert (back[0].extraction != extraction).nnz == 0
    assert back[0].extraordinary_edges == 4
    assert back[1] == ("cube", None) and back[2] == {"a": 1.5}
    assert (back[3] == np.arange(3)).all()
