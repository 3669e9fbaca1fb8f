"""Which move is next: the one with the most expected gain for its work, while it is worth it."""

from collections import Counter
from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.kinds import Expected
from polycube.numerics.lbfgs import count_more
from polycube.plugins import policy as module
from polycube.plugins.policy import PRICE, BestGain
from polycube.search.loop import SECOND, search
from polycube.search.moves import Cure, FitPartly, MeshStructure, Propose, possible
from polycube.stages import Stage
from polycube.state import RunState
from polycube.types import HexMesh, Tier, TriMesh
from tests.fixtures.stages import (
    CALLS,
    TETRAHEDRON,
    BySize,
    Fill,
    Grow,
    Scale,
    grown,
    history,
    size,
    structure,
)

STAGES = [Stage("meshing/optimize", Grow())]


@pytest.fixture(autouse=True)
def forget() -> None:
    CALLS.clear()


def expecting(gains, works=lambda move: 1.0):
    """A made-up estimate: gains and works of moves."""
    return lambda move, history: Expected(gains(move), works(move))


def variants(found) -> list[int]:
    return [move.variant for move in found.moves]


def structures(found) -> list[int]:
    return [move.structure for move in found.moves]


def searched(found, estimate, **options):
    """The history after a search by an estimate."""
    assert search(found, partial(BestGain(**options).moves, estimate=estimate)) is None
    return found


def test_the_move_with_the_most_gain_for_its_work_comes_first():
    gains, works = [0.4, 0.9, 0.6, 0.9], [1.0, 9.0, 1.0, 1.0]
    estimate = expecting(lambda m: gains[m.structure], lambda m: works[m.structure])
    found = history([Stage("meshing/subdivide", Fill())], ranked=[structure(2.0)] * 4)
    assert structures(searched(found, estimate)) == [3, 2, 0, 1]


def test_the_search_ends_when_the_goal_is_met():
    found = history(STAGES, grown(3.0, 10.0, 20.0))
    searched(found, expecting(lambda move: 1.0), effort="thorough")
    assert variants(found) == [0, 1] and found.shortfall == 0


@pytest.mark.parametrize("effort", ["normal", "thorough"])
def test_the_search_ends_when_nothing_is_worth_its_work(effort):
    price = PRICE[effort]
    gains = [1.0, 3 * price, 1.01 * price, price, 5 * price]
    found = history(STAGES, grown(1.0, 2.0, 3.0, 4.0, 5.0))
    searched(found, expecting(lambda move: gains[move.variant]), effort=effort)
    assert variants(found) == [0, 1, 2]


@dataclass(frozen=True)
class Effort:
    """Takes as much work as it is told."""

    work: float

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        count_more(Counter(work=int(self.work * SECOND)))
        return hexes


def toilsome(work: float, *sizes: float):
    """A history whose every mesh takes some work."""
    return history([*STAGES, Stage("meshing/cure", Effort(work))], grown(*sizes))


@pytest.mark.parametrize(("worth", "number"), [(1.5, 2), (2.5, 3), (4.5, 5)])
def test_the_price_rises_with_the_work_since_the_last_gain(worth, number):
    found = toilsome(module.PATIENCE, *np.linspace(1, 0.1, 9))
    searched(found, expecting(lambda move: worth * PRICE["normal"]))
    assert variants(found) == list(range(number))


@pytest.mark.parametrize(("effort", "number"), [("normal", 2), ("thorough", 3)])
def test_the_price_of_a_normal_search_is_higher_after_a_total_work(effort, number):
    gains, large = [1.0, 1.1, 0.9], module.LARGE + 1
    price = module.LATE * PRICE[effort] * large
    estimate = expecting(lambda move: gains[move.variant] * price, lambda move: large)
    found = searched(toilsome(1 + module.MOST["normal"], 1.0, 2.0, 3.0), estimate, effort=effort)
    assert variants(found) == list(range(number))


def test_the_work_of_the_next_move_counts():
    works = [1.0, module.MOST["normal"]]
    gains = [1.0, 0.9 * module.LATE * PRICE["normal"] * works[1]]
    estimate = expecting(lambda move: gains[move.variant], lambda move: works[move.variant])
    assert variants(searched(toilsome(1.0, 1.0, 2.0), estimate)) == [0]
    assert variants(searched(toilsome(1.0, 1.0, 2.0), estimate, effort="thorough")) == [0, 1]


def test_thorough_pays_ten_times_as_much():
    assert PRICE["normal"] == 10 * PRICE["thorough"] > 0


def test_while_there_is_no_mesh_every_expected_gain_is_worth_its_work():
    ranked = [structure(s) for s in (np.nan, 2.0, 3.0)]
    estimate = expecting(lambda move: 1e-9 / (1 + move.structure))
    fails = [Stage("meshing/subdivide", Fill()), Stage("meshing/optimize", Grow(np.inf))]
    for effort in PRICE:
        found = searched(history(fails, ranked=ranked), estimate, effort=effort)
        assert {MeshStructure(n, 0) for n in range(3)} <= set(found.moves)


@settings(deadline=None, max_examples=25)
@given(st.lists(st.floats(0.1, 9.0), min_size=1, max_size=6))
def test_first_makes_one_mesh(sizes):
    found = history(STAGES, grown(*sizes), cure=[Stage("meshing/cure", Scale(2.0))])
    searched(found, expecting(lambda move: 1.0), effort="first")
    assert found.moves == [MeshStructure(0, 0)] and len(found.outcomes) == 1
    assert size(found.leader.state) == sizes[0]


def test_first_proposes_until_there_is_a_structure():
    tiers = {Tier.EXACT: [], Tier.COARSE: [structure(2.0), structure(3.0)], Tier.FINE: [1]}
    estimate = expecting(lambda m: 9.0 - m.tier if isinstance(m, Propose) else 99.0)
    found = history(
        [Stage("meshing/subdivide", Fill())],
        propose=lambda surface, tier: tiers[tier],
        tiers=list(tiers),
        start=RunState(TETRAHEDRON),
    )
    searched(found, estimate, effort="first")
    assert found.moves == [Propose(Tier.EXACT), Propose(Tier.COARSE), MeshStructure(0, 0)]


SIZES = st.floats(-9, 12).filter(lambda x: abs(x) > 0.1) | st.just(np.inf)


@settings(deadline=None, max_examples=25)
@given(st.lists(SIZES, min_size=1, max_size=6), st.floats(1.01, 1.5), st.data())
def test_everything_possible_is_tried_if_it_is_worth_any_price(sizes, factor, data):
    gains = {}

    def gain(move):
        return gains.setdefault(move, data.draw(st.floats(1e9, 1e15)))

    found = history(STAGES, grown(*sizes), cure=[Stage("meshing/cure", Scale(factor))])
    searched(found, expecting(gain), effort="thorough")
    assert found.shortfall == 0 or not possible(found)
    assert len(set(found.moves)) == len(found.moves)
    keys = [each.key for each in found.outcomes]
    assert (found.leader is None) == (not keys)
    assert not keys or found.leader.key == max(keys)


@settings(deadline=None, max_examples=25)
@given(st.lists(SIZES, min_size=1, max_size=6), st.sampled_from(sorted(PRICE)), st.data())
def test_the_policy_ends_whatever_is_expected(sizes, effort, data):
    estimate = expecting(lambda move: data.draw(st.floats(-1, 1) | st.just(np.inf)))
    found = history(STAGES, grown(*sizes), cure=[Stage("meshing/cure", Scale(1.1))])
    searched(found, estimate, effort=effort)
    assert len(set(found.moves)) == len(found.moves) <= 2 * len(sizes)


@dataclass(frozen=True)
class Folded(BySize):
    """A mesh never meets the goal."""

    good: float = 1e9


def test_the_last_resort_is_taken_if_all_meshes_are_folded():
    """`estimate=rules` expects next to nothing of it, but any sound mesh is better."""
    folds = [Stage("meshing/subdivide", Fill()), Stage("meshing/optimize", Scale(-1.0))]
    found = history(folds, ranked=[structure(2.0)], acceptance=Folded())
    assert search(found, BestGain()) is None
    assert FitPartly(0) in found.moves


def test_a_cure_follows_if_it_is_expected_to_pay():
    def gain(move):
        return 0.5 - 0.2 * (move.of == 1) if isinstance(move, Cure) else 1.0 - 0.3 * move.variant

    cure = [Stage("meshing/cure", Scale(1.5))]
    found = history(STAGES, grown(2.0, 1.0, 5.0, 1.0), cure=cure)
    searched(found, expecting(gain))
    assert found.moves[:4] == [
        MeshStructure(0, 0),
        MeshStructure(0, 1),
        Cure(0),
        MeshStructure(0, 2),
    ]
    assert found.moves[4] == Cure(3) and size(found.leader.state) == 7.5


def test_options_are_checked():
    with pytest.raises(ValueError, match="one of first, normal, thorough; got 'more'"):
        BestGain(effort="more")
