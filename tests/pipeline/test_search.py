"""Variants and structures on small made-up stages."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycube.errors import InputError, MeshingError
from polycube.hexmesh.connectivity import hex_mesh
from polycube.pipeline.search import compare, search
from polycube.pipeline.stages import Stage
from polycube.pipeline.state import RunState
from polycube.pipeline.variants import Variants
from polycube.types import HexMesh, Labels, Polycube, RoughMap, TriMesh, Verdict
from tests.fixtures.stages import TETRAHEDRON, BySize, cube

CALLS: list[object] = []


@pytest.fixture(autouse=True)
def forget() -> None:
    CALLS.clear()


@dataclass(frozen=True)
class Scale:
    factor: float = 1.0

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        CALLS.append(self.factor)
        if self.factor == np.inf:
            raise ValueError("factor inf")
        return replace(hexes, vertices=self.factor * hexes.vertices)


@dataclass(frozen=True)
class Grow:
    """Makes a cube of a size: of half that size in a short run."""

    to: float = 1.0
    short: bool = False

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        CALLS.append((self.to, self.short))
        if self.to == np.inf:
            raise ValueError("grown beyond all bounds")
        return cube(self.to / (2 if self.short else 1))


TRIAL = {"meshing/optimize": {"short": True}}
START = RunState(TETRAHEDRON, hexes=cube())


def size(state: RunState) -> float:
    """Of the hexes of a state."""
    return state.hexes.vertices.max()


def scaled(stages: list[Stage], factors: list[float]) -> Variants:
    """All variants run in full; each replaces the factor of `meshing/optimize`."""
    options = [{"meshing/optimize": {"factor": factor}} for factor in factors]
    found = Variants(stages, options, START, BySize())
    for number in range(len(options)):
        found.run(number)
    return found


def test_the_best_is_kept_and_equal_work_is_done_once():
    stages = [Stage("meshing/smooth", Scale(2.0)), Stage("meshing/optimize", Scale(3.0))]
    end, path = scaled(stages, [3.0, 5.0, 3.0]).finish()
    assert size(end) == 10
    assert [mesh.vertices.max() for mesh in path] == [2, 10]
    assert CALLS == [2.0, 3.0, 5.0]
    assert size(START) == 1


def test_a_kind_that_runs_once_runs_on_the_best():
    stages = [Stage("meshing/optimize", Scale(1.0)), Stage("meshing/refine", Scale(7.0))]
    end, path = scaled(stages, [2.0, 5.0, 3.0]).finish()
    assert CALLS == [2.0, 5.0, 3.0, 7.0]
    assert [mesh.vertices.max() for mesh in path] == [5, 35]
    assert size(end) == 35


def test_a_variant_that_fails_is_passed_over_unless_all_do():
    stages = [Stage("meshing/optimize", Scale(1.0))]
    assert size(scaled(stages, [np.inf, 2.0]).finish()[0]) == 2
    with pytest.raises(MeshingError, match="factor inf"):
        scaled(stages, [np.inf]).finish()


@dataclass(frozen=True)
class Place:
    at: float = 1.0

    def __call__(self, *_: object) -> RoughMap:
        axes = [np.array([0.0, 1.0])] * 3
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        return RoughMap(*axes, self.at * grid)


@dataclass(frozen=True)
class Fill:
    def __call__(
        self, surface: TriMesh, polycube: Polycube, rough_map: RoughMap, blocks: None
    ) -> HexMesh:
        CALLS.append(rough_map.positions.max())
        return cube(rough_map.positions.max())


def test_a_variant_of_the_map_gets_hexes_of_its_own():
    stages = [Stage("meshing/map", Place()), Stage("meshing/subdivide", Fill())]
    options = [{"meshing/map": {"at": at}} for at in (1.0, 4.0, 2.0)]
    start = RunState(TETRAHEDRON, labels=Labels([0] * 4, [0] * 4))
    found = Variants(stages, options, start, BySize())
    for number in range(3):
        found.run(number)
    assert size(found.finish()[0]) == 4
    assert CALLS == [1.0, 4.0, 2.0]


def test_a_structure_without_short_runs_takes_no_full_run_from_another():
    stages, judge = [Stage("meshing/optimize", Grow())], BySize(good=9.0)
    poor = Variants(stages, [{"meshing/optimize": {"to": 2.0}}], START, judge, trial=TRIAL)
    options = [{"meshing/optimize": {"to": to}} for to in (3.0, 4.0)]
    plain = Variants(stages, options, START, judge, trial=TRIAL)
    full = Variants(stages, [{"meshing/optimize": {"to": 2.5}}], START, judge)
    found = search([poor, plain, full], lambda tried: False)
    assert full.best == (2.5,) and full.best_short() is None  # above the shorts of 1.5 and 2
    assert found is plain and size(found.finish()[0]) == 4.0


@pytest.mark.parametrize(("first", "expected"), [(2.0, 5.0), (3.0, 3.0)])
def test_a_short_run_that_beats_one_without_short_runs_is_repeated_in_full(first, expected):
    stages, judge = [Stage("meshing/optimize", Grow())], BySize(good=1.0)
    swept = Variants(stages, [{"meshing/optimize": {"to": first}}], START, judge)
    other = Variants(stages, [{"meshing/optimize": {"to": 5.0}}], START, judge, trial=TRIAL)
    found = search([swept, other], lambda tried: False)  # the short run of the other makes 2.5
    assert size(found.finish()[0]) == expected
    assert ((5.0, False) in CALLS) == (expected == 5.0)


def searched(
    *starts: list[float],
    enough: float,
    settled: float = np.inf,
    has_rival: bool = False,
    acceptable: float = 0.0,
):
    """Size that a search ends with, and the runs it took after the first."""
    CALLS.clear()
    stages = [Stage("meshing/optimize", Grow())]
    judge = BySize(good=enough, acceptable=acceptable)

    def structures():
        for sizes in starts:
            variants = [{"meshing/optimize": {"to": to}} for to in sizes]
            yield Variants(stages, variants, START, judge, trial=TRIAL)

    found = search(structures(), lambda tried: tried.reaches >= settled, has_rival)
    end, path = found.finish()
    assert path == (end.hexes,) and found.best == (size(end),)
    return size(end), CALLS[1:]


@pytest.mark.parametrize(
    ("sizes", "enough", "expected", "calls"),
    [
        ([6.0, 9.0], 5.0, 6.0, []),  # the first is good
        ([2.0, 3.0, 8.0, 4.0], 9.0, 8.0, [(2, True), (3, True), (8, True), (4, True), (8, False)]),
        ([2.0, 3.0, 8.0, 7.0], 4.0, 4.0, [(2, True), (3, True), (8, True)]),  # a trial is good
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


@pytest.mark.parametrize(
    ("first", "expected", "calls"),
    [
        (6.0, 7.0, [(7, False)]),  # the first is excellent, so the other has one run
        (8.0, 8.0, [(7, False)]),
        (3.0, 9.0, [(7, False), (9, False)]),  # all variants, until one is good
    ],
)
def test_another_structure_is_compared_with_the_one_found(first, expected, calls):
    stages, judge = [Stage("meshing/optimize", Grow())], BySize(good=9, excellent=5)
    found, other = (
        Variants(stages, [{"meshing/optimize": {"to": to}} for to in sizes], START, judge)
        for sizes in ([first], [7.0, 9.0])
    )
    found.run(0)
    CALLS.clear()
    assert size(compare(found, other).finish()[0]) == expected
    assert CALLS == calls


def test_the_first_run_of_all_is_improved_before_others_follow():
    improved = []

    def improve(first: Variants) -> None:
        improved.append(list(first.attempts))
        first.run_again({"meshing/optimize": {"to": 6.0}})

    stages = [Stage("meshing/optimize", Grow())]
    starts = [
        Variants(stages, [{"meshing/optimize": {"to": to}}], START, BySize(good=5.0), trial=TRIAL)
        for to in (2.0, 4.0)
    ]
    found = search(starts, lambda tried: False, improve=improve)
    assert improved == [[(0, False)]] and found is starts[0]
    assert size(found.finish()[0]) == 6.0


def test_a_start_whose_first_trial_is_worse_has_no_other_run():
    assert searched([3.0, 4.0], [2.0, 9.0], enough=20) == (
        4.0,
        [(3, True), (4, True), (2, True), (4, False)],
    )
    assert searched([3.0, 4.0], [2.0, 9.0], enough=20, has_rival=True) == (
        4.0,
        [(2, True), (3, True), (4, True), (4, False)],
    )


def test_where_no_mesh_is_acceptable_every_variant_has_a_trial():
    found = searched([3.0, 4.0], [2.0, 9.0], enough=20, acceptable=5)
    assert found == (9.0, [(3, True), (4, True), (2, True), (9, True), (9, False)])


@dataclass(frozen=True)
class AtLeast(BySize):
    """A mesh below a size misses something."""

    floor: float = 0.0

    def __call__(self, hexes: HexMesh, surface: TriMesh) -> Verdict:
        found = super().__call__(hexes, surface)
        return found if found.reaches >= self.floor else replace(found, reaches=-np.inf)


@pytest.mark.parametrize(("floor", "full"), [(3.5, [1.0, 4.0]), (10.0, [1.0, 4.0, 3.0])])
def test_two_short_runs_are_repeated_where_the_first_misses_something(floor, full):
    options = [{"meshing/optimize": {"to": to}} for to in (1.0, 2.0, 3.0, 4.0)]
    stages = [Stage("meshing/optimize", Grow())]
    start = Variants(stages, options, START, AtLeast(floor=floor, good=20.0), trial=TRIAL)
    found = search([start], lambda tried: False)
    assert [to for to, short in CALLS if not short] == full
    assert size(found.finish()[0]) == 4.0


@dataclass(frozen=True)
class Loses(AtLeast):
    """A mesh loses so many features for each unit that it is smaller than 4."""

    per_unit: int = 0

    def __call__(self, hexes: HexMesh, surface: TriMesh) -> Verdict:
        found = super().__call__(hexes, surface)
        return replace(found, lost=int(self.per_unit * (4 - hexes.vertices.max())))


@pytest.mark.parametrize(("per_unit", "full"), [(0, [1.0, 4.0, 3.0]), (2, [1.0, 4.0])])
def test_a_short_run_that_loses_more_features_than_the_best_is_not_repeated(per_unit, full):
    options = [{"meshing/optimize": {"to": to}} for to in (1.0, 3.0, 4.0)]
    stages = [Stage("meshing/optimize", Grow())]
    judge = Loses(floor=10.0, good=20.0, per_unit=per_unit)
    search([Variants(stages, options, START, judge, trial=TRIAL)], lambda tried: False)
    assert [to for to, short in CALLS if not short] == full


@pytest.mark.parametrize(("first", "large", "runs"), [(-1.0, 0, 1), (1.0, 0, 3), (-1.0, 9, 3)])
def test_large_meshes_with_inverted_hexes_have_no_other_variants(monkeypatch, first, large, runs):
    monkeypatch.setattr("polycube.pipeline.variants.LARGE", large)
    options = [{"meshing/optimize": {"to": to}} for to in (first, 0.2)]
    found = Variants([Stage("meshing/optimize", Grow())], options, START, BySize(), trial=TRIAL)
    found.run(0)
    found.run_others()
    assert len(CALLS) == runs
    assert found.is_hopeless == (runs == 1)


@dataclass(frozen=True)
class Cross:
    """Makes two cubes that cross each other, or one."""

    crosses: bool = True

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        CALLS.append(self.crosses)
        one = cube()
        if not self.crosses:
            return one
        corners = np.concatenate([one.vertices, one.vertices + 0.4])
        return hex_mesh(corners, np.concatenate([one.hexes, one.hexes + len(one.vertices)]))


@pytest.mark.parametrize(("gives_up", "many", "runs"), [(True, 2, 1), (False, 2, 2), (True, 99, 2)])
def test_meshes_that_cross_themselves_in_many_places_end_the_variants(
    monkeypatch, gives_up, many, runs
):
    monkeypatch.setattr("polycube.pipeline.variants.MANY", many)
    options = [{"meshing/optimize": {"crosses": crosses}} for crosses in (True, False)]
    trial = {"meshing/optimize": {}}
    stages = [Stage("meshing/optimize", Cross())]
    found = Variants(stages, options, START, BySize(good=9.0), trial=trial, gives_up=gives_up)
    found.run(0)
    found.run_others()
    assert CALLS == [True, False][:runs]
    assert found.is_hopeless == (runs == 1)


@given(st.lists(st.floats(1, 100), min_size=1, max_size=6), st.floats(1, 100))
def test_trials_that_rank_right_lose_nothing(sizes, enough):
    found, calls = searched(sizes, enough=enough)
    assert found == max(sizes) or found >= enough
    assert sum(not short for _, short in calls) <= 1


@dataclass(frozen=True)
class Refuse:
    def __call__(self, *_: object) -> RoughMap:
        CALLS.append("refused")
        raise MeshingError("no map")


@pytest.mark.parametrize("n_structures", [1, 2])
def test_where_all_fail_the_first_failure_is_told(n_structures):
    stages = [Stage("meshing/map", Refuse()), Stage("meshing/optimize", Grow())]
    start = RunState(TETRAHEDRON, hexes=cube())
    structures = [
        Variants(stages, [{}, {}], start, BySize(), trial=TRIAL) for _ in range(n_structures)
    ]
    found = search(structures, lambda tried: tried.reaches >= 1)
    with pytest.raises(MeshingError, match="no map"):
        found.finish()
    assert CALLS == ["refused"] * n_structures  # once for all variants of a structure
    with pytest.raises(MeshingError, match="no map"):
        found.taken()


@pytest.mark.parametrize("where", ["variants", "trial"])
def test_variants_of_another_plugin_are_refused(where):
    odd = {"meshing/optimize": {"features": False, "factor": 2.0}}
    variants, trial = ([{}, odd], {}) if where == "variants" else ([{}], odd)
    stages = [Stage("meshing/optimize", Scale(3.0))]
    with pytest.raises(InputError, match=r"sets features of meshing/optimize, which Scale does"):
        Variants(stages, variants, START, BySize(), trial=trial)
