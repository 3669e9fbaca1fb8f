"""What the fixed rules expect of a move: their order on cases whose answer is known."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.kinds import Expected
from polycube.plugins.estimate import FEW, Rules
from polycube.search.history import History
from polycube.search.moves import (
    AlongCreases,
    Closer,
    Cure,
    Finer,
    FitPartly,
    Given,
    MeshStructure,
    MoreParts,
    Propose,
)
from polycube.stages import Stage
from polycube.state import RunState
from polycube.types import HexMesh, Tier, TriMesh, Verdict
from tests.fixtures.hexmeshes import hex_box, surface_of
from tests.fixtures.stages import TETRAHEDRON, Fill, cube, history, structure
from tests.fixtures.surfaces import halved_box

FILL = [Stage("meshing/subdivide", Fill())]
RULES = Rules()


def knows(*entries, surface: TriMesh = TETRAHEDRON) -> History:
    return history(FILL, start=RunState(surface), ranked=entries)


def missed(found: History, structure: int = 0, mesh: HexMesh | None = None, **parts: float):
    """Add a mesh of a structure that misses the goal by these parts."""
    verdict = Verdict((), (), (-sum(parts.values()),), parts)
    task = replace(found.task, acceptance=lambda *_: verdict)
    found.task = task
    state = replace(found.start(structure), hexes=mesh or cube())
    return found.add(MeshStructure(structure, 0), state, {}, {})


def rate(move, found: History) -> float:
    expected = RULES(move, found)
    assert expected.gain >= 0 and expected.work > 0 and np.isfinite(expected).all()
    return expected.gain / expected.work


def test_nothing_is_expected_of_an_unknown_move():
    assert RULES(object(), knows()) == Expected(0.0, FEW)
    assert RULES(Given(), knows()).gain == 0


@pytest.mark.parametrize("surface", [TETRAHEDRON, halved_box()], ids=["plain", "cad"])
def test_every_tier_may_make_a_mesh_if_there_is_none(surface):
    rates = {tier: rate(Propose(tier), knows(surface=surface)) for tier in Tier}
    assert min(rates.values()) > rate(FitPartly(0), knows(surface=surface)) > 0
    assert max(rates, key=rates.get) == Tier.EXACT
    assert rates[Tier.COARSE] > rates[Tier.LEARNED]


def test_less_is_expected_the_nearer_the_goal_is():
    found = knows(structure(1.0), structure(2.0, score=2.0))
    far = RULES(MeshStructure(1, 0), found).gain
    missed(found, features=0.9)
    near = RULES(MeshStructure(1, 0), found).gain
    missed(found, features=0.1)
    assert far > near > RULES(MeshStructure(1, 0), found).gain == 0


def test_a_better_score_is_more_promising():
    found = knows(structure(1.0, score=3.0), structure(2.0, score=9.0), structure(3.0, score=30.0))
    rates = [rate(MeshStructure(number, 0), found) for number in range(3)]
    assert rates == sorted(rates, reverse=True) and len(set(rates)) == 3


def test_each_mesh_of_a_tier_makes_the_others_less_likely():
    found = knows(structure(1.0), structure(2.0), structure(2.0, Tier.LEARNED))
    before = [rate(MeshStructure(n, 0), found) for n in (1, 2)]
    missed(found, features=8.0)
    after = [rate(MeshStructure(n, 0), found) for n in (1, 2)]
    assert after[0] < before[0]
    left = (8.0 - 0.15) / (8.0 - 0.15)
    assert after[1] == pytest.approx(before[1] * left)


def test_exact_hexes_come_first_and_substitutes_last():
    found = knows(*(structure(1.0, tier) for tier in Tier))
    gains = {tier: RULES(MeshStructure(int(tier), 0), found).gain for tier in Tier}
    assert max(gains, key=gains.get) == Tier.EXACT
    assert gains[Tier.COARSE] > gains[Tier.LEARNED] and gains[Tier.FINE] > gains[Tier.LAST]


def test_exact_hexes_are_meshed_before_other_structures_are_proposed():
    found = knows(structure(1.0, Tier.EXACT))
    waits = RULES(Propose(Tier.COARSE), found)
    assert waits.gain == pytest.approx(0.1 * RULES(Propose(Tier.COARSE), knows()).gain)
    missed(found, features=4.0, validity=2.0)
    failed = RULES(Propose(Tier.COARSE), found)
    assert failed.gain > waits.gain and failed.work == waits.work


@pytest.mark.parametrize("tier", [Tier.COARSE, Tier.LEARNED, Tier.FINE])
def test_other_structures_rarely_beat_exact_hexes(tier):
    moves = [Propose(tier), MeshStructure(1, 0)]
    gains = []
    for first in (Tier.LAST, Tier.EXACT):
        found = knows(structure(1.0, first), structure(1.0, tier))
        missed(found, scaled_jacobian=0.9)
        gains.append([RULES(move, found).gain for move in moves])
    assert gains[1] == pytest.approx(np.multiply(0.2, gains[0]))
    found.leader = missed(found, features=0.9)
    wanted = np.multiply(0.2 if tier == Tier.FINE else 1, gains[0])
    assert [RULES(move, found).gain for move in moves] == pytest.approx(wanted)


def test_other_variants_are_for_meshes_that_miss_something_they_can_help():
    found = knows(structure(1.0))
    first, second, third = (RULES(MeshStructure(0, variant), found).gain for variant in range(3))
    assert first > second > third > 0  # the variants before made no mesh
    missed(found, scaled_jacobian=0.8)
    second, third = (RULES(MeshStructure(0, variant), found).gain for variant in (1, 2))
    assert 0.8 > second > third > 0


def test_no_variant_follows_inverted_hexes():
    found = knows(structure(1.0))
    missed(found, validity=3.0)
    assert RULES(MeshStructure(0, 1), found).gain == 0
    other = knows(structure(1.0))
    missed(other, validity=2.0)
    assert RULES(MeshStructure(0, 1), other).gain > 0


def test_a_variant_must_make_up_for_what_its_structure_is_behind():
    found = knows(structure(1.0), structure(2.0))
    missed(found, 0, scaled_jacobian=0.9)
    ahead = RULES(MeshStructure(0, 1), found).gain
    missed(found, 1, scaled_jacobian=0.8)
    assert RULES(MeshStructure(0, 1), found).gain == pytest.approx(ahead - 0.1)
    missed(found, 1, scaled_jacobian=0.1)
    assert RULES(MeshStructure(0, 1), found).gain == 0


def test_a_cure_is_for_poor_hexes_and_costs_by_their_number():
    found = knows(structure(1.0))
    mesh = hex_box((3, 3, 3))
    good = missed(found, mesh=mesh, features=0.5)
    assert RULES(Cure(good.number), found).gain == 0
    inner = np.setdiff1d(np.arange(len(mesh.vertices)), mesh.quads)
    vertices = mesh.vertices.copy()
    vertices[inner[0]] += 0.2
    poor = missed(found, mesh=replace(mesh, vertices=vertices), scaled_jacobian=0.5)
    expected = RULES(Cure(poor.number), found)
    assert 0 < expected.gain < 0.5 and expected.work > RULES(Cure(good.number), found).work
    other = knows(structure(1.0))
    both = missed(other, mesh=poor.state.hexes, scaled_jacobian=0.5, features=0.5)
    assert 0 < RULES(Cure(both.number), other).gain < expected.gain  # it may be replaced


def test_a_cure_must_make_up_for_what_its_mesh_is_behind():
    found = knows(structure(1.0), structure(2.0))
    mesh = missed(found, 0, scaled_jacobian=0.9)
    ahead = RULES(Cure(mesh.number), found).gain
    missed(found, 1, scaled_jacobian=0.8)
    assert RULES(Cure(mesh.number), found).gain == pytest.approx(ahead - 0.1)
    missed(found, 1, scaled_jacobian=0.1)
    assert RULES(Cure(mesh.number), found).gain == 0


@pytest.mark.parametrize(
    ("kind", "helps"),
    [(Finer, "features"), (Closer, "wishes"), (AlongCreases, "wishes"), (MoreParts, "wishes")],
)
def test_a_mesh_is_repeated_for_what_it_misses(kind, helps):
    found = knows(structure(1.0))
    for name in ("features", "wishes"):
        outcome = missed(found, **{name: 0.6})
        expected = RULES(kind(outcome.number), found)
        assert (expected.gain > 0) == (name == helps) and expected.gain < 0.6
    large = missed(found, mesh=hex_box((12, 12, 12)), **{helps: 0.6})
    assert RULES(kind(large.number), found).work > expected.work


def test_the_last_resort_pays_if_the_best_mesh_is_folded_and_follows_cures():
    found = knows(structure(1.0), structure(2.0))
    folded = missed(found, mesh=cube(-1.0), validity=3.0)
    assert 0.005 < rate(FitPartly(0), found) < rate(Cure(folded.number), found)


def test_more_features_need_a_finer_lattice():
    """Of a CAD part: 32 points, curves and faces, and none."""
    surface = surface_of(hex_box((2, 2, 2)))
    plain, cad = (
        RULES(Propose(Tier.FINE), knows(surface=each)).gain for each in (surface, halved_box())
    )
    assert cad > plain > 0
    one = structure(1.0, Tier.FINE)
    assert rate(MeshStructure(0, 0), knows(one, surface=surface)) > rate(
        MeshStructure(0, 0), knows(one, surface=halved_box())
    )


def test_a_mesh_is_cured_only_if_it_would_then_lead():
    found = knows(structure(1.0), structure(2.0))
    missed(found, 0, features=0.5)  # leads
    near = missed(found, 1, scaled_jacobian=0.8)
    far = missed(found, 1, scaled_jacobian=0.8, distances=0.5)
    assert RULES(Cure(near.number), found).gain > 0
    assert RULES(Cure(far.number), found).gain == 0


def test_a_cure_may_remove_what_the_report_warns_about():
    """A finer mesh with fewer lost features is behind by its warning and its worst hex alone."""
    found = knows(structure(1.0), structure(2.0))
    missed(found, 0, features=0.5)  # leads
    finer = missed(found, 1, features=0.3, scaled_jacobian=0.2, warnings=0.25)
    assert 0 < RULES(Cure(finer.number), found).gain < 0.2
    good = missed(found, 1, features=0.3, warnings=0.25)  # without poor hexes nothing is moved
    assert RULES(Cure(good.number), found).gain == 0


def test_a_mesh_far_behind_is_not_made_valid():
    """What it misses besides is known: it would be behind the leading mesh anyway."""
    found = knows(structure(1.0), structure(2.0))
    missed(found, 0, features=0.8)
    missed(found, 1, features=0.6, validity=2.0)
    assert RULES(Cure(1), found).gain > 0
    missed(found, 1, features=0.9, validity=2.0)
    assert RULES(Cure(2), found).gain == 0
