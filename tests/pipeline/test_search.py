"""The search for the best mesh, on small made-up stages."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycube.errors import MeshingError
from polycube.pipeline.search import compare, search
from polycube.stages import Stage
from polycube.state import RunState
from polycube.pipeline.variants import Variants
from polycube.types import HexMesh, RoughMap, TriMesh, Verdict
from tests.fixtures.stages import CALLS, START, TETRAHEDRON, TRIAL, BySize, Grow, cube, size


@pytest.fixture(autouse=True)
def forget() -> None:
    CALLS.clear()


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
    good: float,
    settled: float = np.inf,
    has_rival: bool = False,
    acceptable: float = 0.0,
):
    """Size that a search ends with, and the runs it took after the first."""
    CALLS.clear()
    stages = [Stage("meshing/optimize", Grow())]
    judge = BySize(good=good, acceptable=acceptable)

    def structures():
        for sizes in starts:
            variants = [{"meshing/optimize": {"to": to}} for to in sizes]
            yield Variants(stages, variants, START, judge, trial=TRIAL)

    found = search(structures(), lambda tried: tried.reaches >= settled, has_rival)
    end, path = found.finish()
    assert path == (end.hexes,) and found.best == (size(end),)
    return size(end), CALLS[1:]


@pytest.mark.parametrize(
    ("sizes", "good", "expected", "calls"),
    [
        ([6.0, 9.0], 5.0, 6.0, []),  # the first is good
        ([2.0, 3.0, 8.0, 4.0], 9.0, 8.0, [(2, True), (3, True), (8, True), (4, True), (8, False)]),
        ([2.0, 3.0, 8.0, 7.0], 4.0, 4.0, [(2, True), (3, True), (8, True)]),  # a trial is good
        ([9.0, 2.0], 10.0, 9.0, [(9, True), (2, True), (2, False)]),  # the best of the others
        ([np.inf, 2.0, 4.0], 9.0, 4.0, [(np.inf, True), (2, True), (4, True), (4, False)]),
        ([2.0], 9.0, 2.0, [(2, True)]),  # nothing to choose from
    ],
)
def test_of_the_others_only_the_best_in_a_trial_is_run_in_full(sizes, good, expected, calls):
    assert searched(sizes, good=good) == (expected, calls)


@pytest.mark.parametrize(
    ("settled", "has_rival", "expected", "calls"),
    [
        (3.0, False, 4.0, [(3, True), (4, True), (4, False)]),  # no other start is looked at
        (9.0, False, 9.0, [(3, True), (4, True), (7, True), (9, True), (9, False)]),
        (9.0, True, 9.0, [(7, True), (9, True), (9, False)]),  # the rival comes first
    ],
)
def test_another_start_goes_on_where_its_first_trial_is_better(settled, has_rival, expected, calls):
    found = searched([3.0, 4.0], [7.0, 9.0], good=20, settled=settled, has_rival=has_rival)
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
    assert searched([3.0, 4.0], [2.0, 9.0], good=20) == (
        4.0,
        [(3, True), (4, True), (2, True), (4, False)],
    )
    assert searched([3.0, 4.0], [2.0, 9.0], good=20, has_rival=True) == (
        4.0,
        [(2, True), (3, True), (4, True), (4, False)],
    )


def test_where_no_mesh_is_acceptable_every_variant_has_a_trial():
    found = searched([3.0, 4.0], [2.0, 9.0], good=20, acceptable=5)
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


@given(st.lists(st.floats(1, 100), min_size=1, max_size=6), st.floats(1, 100))
def test_trials_that_rank_right_lose_nothing(sizes, good):
    found, calls = searched(sizes, good=good)
    assert found == max(sizes) or found >= good
    assert sum(not short for _, short in calls) <= 1


@dataclass(frozen=True)
class Refuse:
    def __call__(self, *_: object) -> RoughMap:
        CALLS.append("refused")
        raise MeshingError("no map")


@pytest.mark.parametrize("n_structures", [1, 2])
def test_if_all_runs_fail_the_first_error_is_raised(n_structures):
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
