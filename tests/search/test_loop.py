"""The loop of a search, on small made-up stages, with the moves of any policy."""

import threading
import time
from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.errors import MeshingError
from polycube.kinds import Expected
from polycube.numerics.lbfgs import descend
from polycube.search.chain import NOT_FITTED, Chain, Deadline
from polycube.search.history import NO_MESH
from polycube.search.loop import SECOND, search
from polycube.search.moves import Cure, MeshStructure, Propose
from polycube.stages import Clock, Stage
from polycube.state import RunState
from polycube.types import HexMesh, RoughMap, Tier, TriMesh, Verdict
from tests.fixtures.stages import (
    CALLS,
    TETRAHEDRON,
    BySize,
    Fill,
    Grow,
    Scale,
    cube,
    grown,
    history,
    script,
    size,
    structure,
)

OPTIMIZE = "meshing/optimize"
STAGES = [Stage(OPTIMIZE, Grow())]
SIZES = st.floats(-9, 9).filter(lambda x: abs(x) > 0.1) | st.just(np.inf)


def meshes(n: int) -> list[MeshStructure]:
    """The first variants of the given mesh."""
    return [MeshStructure(0, number) for number in range(n)]


def test_the_table_says_what_was_expected_and_what_came():
    found = history(STAGES, grown(2.0, np.inf, 1.0, 8.0))
    wanted = Expected(0.5, 3.0)

    def policy(*_: object):
        yield from ((move, wanted) for move in meshes(4))

    assert search(found, policy) is None
    assert [row.name for row in found.table] == [f"variant {number}" for number in (1, 2, 3, 4)]
    assert [row.expected for row in found.table] == [wanted] * 4
    gains = [NO_MESH - 0.8, 0, 0, 0.6]
    assert [row.gain for row in found.table] == pytest.approx(gains)
    assert [row.hexes for row in found.table] == [1, 0, 1, 1]
    assert [row.result for row in found.table] == [
        "valid",
        "stage meshing/optimize failed: ValueError: grown beyond all bounds",
        "valid",
        "valid",
    ]
    assert sum(row.gain for row in found.table) == pytest.approx(NO_MESH - found.shortfall)
    assert size(found.leader.state) == 8 and len(found.outcomes) == 3
    assert found.why_no_mesh == found.table[1].result


def test_work_is_counted_in_evaluated_coordinates():
    @dataclass(frozen=True)
    class Descend(Grow):
        def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
            descend(lambda x: (float(x @ x), 2 * x), np.ones(5), 1)
            return hexes

    found = history([Stage(OPTIMIZE, Descend())], {"portfolio": [{}, {}]})
    search(found, script(*meshes(2)))
    assert [row.work for row in found.table] == [2 * 5 / SECOND, 0]  # the second is known


def test_moves_are_logged(caplog):
    caplog.set_level("DEBUG")
    search(history(STAGES, grown(2.0)), script(*meshes(1)))
    assert "variant 1: expected gain 0.000 for 1.0" in caplog.messages
    assert "variant 1: valid; gain 7.200 for 0.0" in caplog.messages
    assert [record.best for record in caplog.records if hasattr(record, "best")] == [1.0]


def test_structures_are_no_mesh():
    found = history(
        [Stage("meshing/subdivide", Fill())],
        propose=lambda surface, tier: [structure(2.0, tier), structure(3.0, tier)],
        tiers=[Tier.EXACT, Tier.FINE],
    )
    search(found, script(Propose(Tier.FINE), MeshStructure(1, 0)))
    assert [row.result for row in found.table] == ["no mesh", "valid"]
    assert size(found.leader.state) == 3 and found.proposed == [Tier.FINE]
    assert [entry.candidate.tier for entry in found.ranked] == [Tier.FINE] * 2


def any_moves(data: st.DataObject, checked):
    """A policy that makes possible moves in any order."""

    def policy(history, possible):
        while moves := possible():
            checked(history)
            yield data.draw(st.sampled_from(moves)), Expected(0.0, 1.0)
        checked(history)

    return policy


@settings(deadline=None)
@given(st.lists(SIZES, min_size=1, max_size=5), st.floats(0.5, 2.0), st.data())
def test_the_leader_is_the_best_whatever_the_verdicts_and_the_policy(sizes, factor, data):
    def check(now):
        keys = [each.key for each in now.outcomes]
        assert (now.leader is None) == (not keys)
        assert not keys or now.leader.key == max(keys)
        assert len(set(now.moves)) == len(now.moves) == len(now.table)

    found = history(STAGES, grown(*sizes), cure=[Stage("meshing/cure", Scale(factor))])
    assert search(found, any_moves(data, check)) is None
    made = [s for s in sizes if s != np.inf]
    assert [m for m in found.moves if isinstance(m, MeshStructure)] == meshes(len(sizes))
    if made and max(made) > 0:
        assert size(found.leader.state) >= max(made)
        assert size(found.leader.state) == max(size(each.state) for each in found.outcomes)


@dataclass
class EndsAfter(Clock):
    """Ends the run after some stages."""

    stages: int = 0
    end: threading.Event = field(default_factory=threading.Event)

    def run(self, name, call):
        value = super().run(name, call)
        self.stages -= 1
        if self.stages == 0:
            self.end.set()
        return value


@settings(deadline=None)
@given(st.lists(SIZES, min_size=1, max_size=6), st.integers(1, 6))
def test_an_interrupted_search_returns_the_best_of_all_meshes(sizes, stages):
    CALLS.clear()
    clock = EndsAfter(stages=stages)
    chain = Chain(clock, Deadline(interrupt=clock.end))
    found = history(STAGES, grown(*sizes), chain=chain)
    ended = search(found, script(*meshes(len(sizes))))
    done = [s for s in CALLS if s != np.inf]  # equal variants are run once
    assert ended == ("user" if len(done) == stages else None)
    assert (found.leader is None) == (not done)
    if done:
        assert found.leader.key == max(each.key for each in found.outcomes)
        assert max(done) < 0 or size(found.leader.state) == max(done)
        assert len(found.outcomes) == len(found.table) + (ended is not None) - sum(
            row.hexes == 0 for row in found.table
        )


def test_the_time_ends_a_descent_and_the_best_mesh_stays():
    @dataclass(frozen=True)
    class Slow(Grow):
        def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
            end = time.monotonic() + (20 if self.to == 3 else 0)
            while time.monotonic() < end:
                descend(lambda x: (float(x @ x), 2 * x), np.ones(3), 5)
            return super().__call__(surface, hexes)

    found = history(
        [Stage(OPTIMIZE, Slow())], grown(2.0, 3.0, 4.0), chain=Chain(deadline=Deadline(0.4))
    )
    assert search(found, script(*meshes(3))) == "time"
    assert size(found.leader.state) == 2 and len(found.outcomes) == 1 and CALLS == [2]
    assert found.moves == meshes(2)


@dataclass(frozen=True)
class Place:
    def __call__(self, *_: object) -> RoughMap:
        axes = [np.array([0.0, 1.0])] * 3
        return RoughMap(*axes, 5 * np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1))


@pytest.mark.parametrize("before", [False, True])
def test_hexes_that_are_not_fitted_are_no_result_beside_a_mesh(before):
    """The second stage of the last move ends the run: hexes of a lattice, larger than the mesh."""
    clock = EndsAfter(stages=2 + before)
    stages = [Stage("meshing/map", Place()), Stage("meshing/subdivide", Fill())]
    chain = Chain(clock, Deadline(interrupt=clock.end))
    found = history(stages, start=RunState(TETRAHEDRON), ranked=[structure(1.0)], chain=chain)
    if before:
        found.add(MeshStructure(0, 9), RunState(TETRAHEDRON, hexes=cube(2.0)), {}, {})
        clock.stages = 2
    assert search(found, script(MeshStructure(0, 0))) == "user"
    assert size(found.leader.state) == (2 if before else 5)
    assert found.leader.verdict.is_valid == before
    assert before or found.leader.verdict.failures == (NOT_FITTED,)


def test_a_mesh_that_was_finished_when_the_time_was_over_is_judged_once():
    clock, judged = EndsAfter(), []

    class Counts(BySize):
        def __call__(self, hexes, surface):
            clock.end.set()  # the time is over while the mesh is judged
            judged.append(hexes)
            return super().__call__(hexes, surface)

    chain = Chain(clock, Deadline(interrupt=clock.end))
    found = history(STAGES, grown(2.0, 3.0), acceptance=Counts(), chain=chain)
    assert search(found, script(*meshes(2))) == "user"
    assert len(judged) == len(found.outcomes) == 1


def test_cures_are_kept_only_if_they_are_better():
    stages = [Stage("meshing/cure", Scale(0.5)), Stage("meshing/pillow", Scale(3.0))]
    found = history(STAGES, grown(2.0), cure=stages[:1])
    search(found, script(*meshes(1), Cure(0)))
    assert size(found.leader.state) == 2 and found.table[1].gain == 0
    found = history(STAGES, grown(2.0), cure=stages)
    search(found, script(*meshes(1), Cure(0)))
    assert size(found.leader.state) == 3
    assert set(found.leader.results) == {OPTIMIZE, "meshing/cure", "meshing/pillow"}


def test_an_error_of_input_ends_the_search():
    def policy(*_: object):
        yield from ()
        raise MeshingError("the policy is broken")

    with pytest.raises(MeshingError, match="the policy is broken"):
        search(history(STAGES), policy)


def test_a_policy_that_fails_ends_the_search_with_the_mesh_so_far(caplog):
    def policy(history: object, possible: object):
        yield from script(*meshes(1))(history, possible)
        raise ZeroDivisionError("no gain")

    found = history(STAGES, grown(2.0, 8.0))
    assert search(found, policy) is None
    assert size(found.leader.state) == 2
    assert "policy function failed: ZeroDivisionError: no gain; the best" in caplog.text


def test_a_policy_that_fails_before_there_is_a_mesh_is_named():
    def policy(*_: object):
        raise ZeroDivisionError("no gain")

    with pytest.raises(MeshingError, match="policy function failed: ZeroDivisionError: no gain"):
        search(history(STAGES, grown(2.0)), policy)


def test_a_mesh_on_which_the_acceptance_fails_is_not_valid_and_never_leads():
    @dataclass(frozen=True)
    class Picky(BySize):
        def __call__(self, hexes: HexMesh, surface: TriMesh) -> Verdict:
            if hexes.vertices.max() > 5:
                raise ValueError("too large for me")
            return super().__call__(hexes, surface)

    found = history(STAGES, grown(8.0, 2.0, 9.0), acceptance=Picky())
    search(found, script(*meshes(3)))
    why = "not valid: acceptance Picky failed: ValueError: too large for me"
    assert [row.result for row in found.table] == [why, "valid", why]
    assert size(found.leader.state) == 2
