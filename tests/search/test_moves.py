"""What can be done next, and what becomes of it, on small made-up stages."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from polycube.search.moves import MOVES, Cure, FitPartly, Given, MeshStructure, Propose, possible
from polycube.stages import Stage
from polycube.state import RunState
from polycube.types import HexMesh, Tier, TriMesh
from tests.fixtures.stages import (
    CALLS,
    START,
    TETRAHEDRON,
    Fill,
    Grow,
    Scale,
    cube,
    grown,
    history,
    made,
    size,
    structure,
)

STAGES = [Stage("meshing/optimize", Grow())]
FILL = [Stage("meshing/subdivide", Fill()), Stage("meshing/optimize", Scale())]
CURE = [Stage("meshing/cure", Scale(2.0))]


def now(found, kind) -> list:
    return [move for move in possible(found) if type(move) is kind]


def test_every_tier_is_proposed_once():
    tiers, asked = [Tier.EXACT, Tier.COARSE], []

    def propose(surface, tier):
        asked.append((surface, tier))
        return [structure(1.0, tier)]

    found = history(FILL, propose=propose, tiers=tiers)
    assert now(found, Propose) == [Propose(tier) for tier in tiers]
    made(found, Propose(Tier.COARSE))
    assert now(found, Propose) == [Propose(Tier.EXACT)]
    made(found, Propose(Tier.EXACT))
    assert now(found, Propose) == []
    assert asked == [(found.task.start.surface, tier) for tier in reversed(tiers)]
    assert [entry.candidate.tier for entry in found.ranked] == tiers[::-1]


def test_the_variants_of_a_structure_follow_one_another():
    bundle = {"own": [{}, {"meshing/optimize": {"factor": 2.0}}]}
    ranked = [structure(1.0), structure(3.0, Tier.FINE, "own")]
    found = history(FILL, bundle, ranked=ranked)
    assert now(found, MeshStructure) == [MeshStructure(0, 0), MeshStructure(1, 0)]
    made(found, MeshStructure(1, 0))
    assert now(found, MeshStructure) == [MeshStructure(0, 0), MeshStructure(1, 1)]
    made(found, MeshStructure(1, 1), MeshStructure(0, 0))
    assert now(found, MeshStructure) == []
    assert [size(each.state) for each in found.outcomes] == [3, 6, 1]
    assert [each.state.chosen for each in found.outcomes] == [1, 1, 0]
    assert set(found.leader.results) == {"meshing/subdivide", "meshing/optimize"}
    assert found.leader.options == bundle["own"][1]


def test_a_given_mesh_has_the_variants_of_the_portfolio():
    found = history(STAGES, grown(2.0, 3.0))
    assert now(found, MeshStructure) == [MeshStructure(0, 0)]
    made(found, Given(), MeshStructure(0, 0))
    assert now(found, MeshStructure) == [MeshStructure(0, 1)]
    assert [size(each.state) for each in found.outcomes] == [1, 2] and CALLS == [2]


@pytest.mark.parametrize(
    ("tiers", "expected"),
    [
        ([Tier.COARSE, Tier.LAST], [0]),
        ([Tier.LAST, Tier.FINE], [1]),
        ([Tier.LAST, Tier.LAST], [0, 1]),
        ([], []),
    ],
)
def test_a_substitute_is_meshed_only_if_there_is_nothing_else(tiers, expected):
    ranked = [structure(1.0, tier) for tier in tiers]
    found = history(FILL, start=RunState(TETRAHEDRON), ranked=ranked)
    assert [move.structure for move in now(found, MeshStructure)] == expected


def test_a_resumed_run_has_its_structure_only():
    found = history(FILL, ranked=[structure(1.0), structure(2.0)])
    found.only = 1
    assert now(found, MeshStructure) == [MeshStructure(1, 0)]


def test_only_fitted_meshes_that_were_not_cured_are_cured():
    found = history(STAGES, grown(2.0, 1.0, 5.0), cure=CURE)
    assert now(found, Cure) == []
    made(found, MeshStructure(0, 0), MeshStructure(0, 1))
    assert now(found, Cure) == [Cure(0), Cure(1)]
    made(found, Cure(0))
    assert size(found.leader.state) == 4 and now(found, Cure) == [Cure(1)]
    state = replace(START, hexes=cube(3.0), unfitted="it is not fitted")
    found.add(Given(), state, {}, {})
    made(found, MeshStructure(0, 2))
    assert now(found, Cure) == [Cure(1), Cure(4)]
    assert now(history(STAGES), Cure) == []
    without = made(history(STAGES), MeshStructure(0, 0))
    assert now(without, Cure) == []


@dataclass(frozen=True)
class Keep:
    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        return hexes


def test_a_cure_that_changes_nothing_makes_no_mesh():
    found = made(history(STAGES, cure=[Stage("meshing/cure", Keep())]), MeshStructure(0, 0))
    made(found, Cure(0))
    assert len(found.outcomes) == 1 and found.table[-1].result == "no mesh"
    assert now(found, Cure) == []


def test_the_last_resort_is_for_searches_without_a_sound_mesh():
    ranked = [structure(1.0), structure(2.0, Tier.FINE), structure(3.0, Tier.FINE)]
    bundle = {"portfolio": [{"meshing/optimize": {"factor": f}} for f in (-1.0, 1.0)]}
    found = history(FILL, bundle, ranked=ranked)
    assert now(found, FitPartly) == []  # nothing was tried
    made(found, MeshStructure(0, 0))
    assert found.leader.key[0] == 0
    assert set(now(found, FitPartly)) == {FitPartly(2), FitPartly(0)}
    made(found, MeshStructure(0, 1))
    assert now(found, FitPartly) == []


def test_the_last_resort_without_any_mesh_is_the_best_ranked_structure():
    ranked = [structure(1.0), structure(2.0)]
    fails = [FILL[0], Stage("meshing/optimize", Grow(np.inf))]
    found = made(history(fails, ranked=ranked), MeshStructure(1, 0))
    assert found.leader is None and now(found, FitPartly) == [FitPartly(0)]


def test_a_move_that_would_do_the_same_is_the_same():
    assert MeshStructure(1, 2) == MeshStructure(1, 2) != MeshStructure(2, 1)
    assert len({Cure(1), Cure(1), Cure(2), FitPartly(1)}) == 3
    moves = {kind(1) for kind in MOVES if kind not in (MeshStructure, Propose)}
    assert len(moves) == len(MOVES) - 2  # one class is not equal to another


def test_moves_are_described():
    found = history(FILL, ranked=[structure(1.0)])
    assert Propose(Tier.FINE).describe(found) == "propose fine structures"
    name = MeshStructure(0, 1).describe(found)
    assert name.startswith("structure 0 (made up, ") and name.endswith(", variant 2")
    assert MeshStructure(0, 1).describe(history(STAGES)) == "variant 2"
    texts = [kind(7).describe(found) for kind in MOVES if kind not in (MeshStructure, Propose)]
    assert len(set(texts)) == len(texts) and all(" 7" in text for text in texts)
