"""Ranking by a short registration."""

import logging
from dataclasses import replace

import numpy as np
import pytest

from polycube.fitting.registration import ShortQuality
from polycube.hexmesh.generation import blocks
from polycube.hexmesh.generation.template import counts, mesh
from polycube.plugins.ranking.registration import Registration, short_score
from polycube.structure.lattice import collapse, lattice
from polycube.structure.rough_map import affine_map, identity_map
from polycube.types import Candidate, Ranked, Tier, TriMesh
from tests.fixtures.polycubes import PRIMITIVES, TWO, part

SCALE = np.diag([10.0, 8.0, 8.0])
PERFECT = ShortQuality(0.0, 0.0, 0.0, 1.0, 1.0, 1.0)


def rank(surface: TriMesh, candidates: list[Candidate], **options: object) -> list[Ranked]:
    """Rank candidates by the plugin with some options."""
    return Registration(**options)(surface, candidates)


def candidate(context, linear=SCALE, cost=0.0, proposal="slices") -> Candidate:
    polycube = collapse(lattice(TWO, context, PRIMITIVES))
    rough_map = affine_map(polycube, linear, np.zeros(3))
    return Candidate(proposal, polycube, rough_map, cost, str(context))


def test_a_good_placement_is_ranked_first_and_a_wrong_genus_not_at_all(caplog):
    caplog.set_level(logging.INFO)
    surface = part(("cube", "hole_y"), SCALE)
    good = candidate(("cube", "hole_y"), SCALE * 0.95)
    bad = candidate(("cube", "hole_z"), SCALE * 0.95)
    ranked = rank(surface, [bad, candidate(("cube", "cube")), good], rounds=3)
    assert [entry.candidate for entry in ranked] == [good, bad]
    assert ranked[0].score < 2 < ranked[1].score
    assert ranked[0].numbers["volume_ratio"] == pytest.approx(1, abs=0.05)
    assert "cube, hole_y" in caplog.text
    assert rank(surface, []) == []


def test_positions_are_those_of_the_vertices_before_registration():
    one = candidate(("cube", "hole_y"))
    entry = rank(part(("cube", "hole_y"), SCALE), [one], rounds=1, size=0.1)[0]
    parts = counts(one.polycube, one.rough_map, 0.1 * np.linalg.norm([20, 8, 8]))
    expected = mesh(one.polycube, identity_map(one.polycube), parts)
    np.testing.assert_array_equal(entry.positions, expected.vertices)
    np.testing.assert_array_equal(entry.hexes.hexes, expected.hexes)


def test_overlays_come_last_and_are_not_registered():
    surface = part(("cube", "cube"), SCALE)
    poor = candidate(("cube", "cube"), SCALE * 0.3, cost=50.0)
    fine = replace(candidate(("cube", "cube")), tier=Tier.FINE)
    ranked = rank(surface, [fine, poor], rounds=1)
    assert [entry.candidate for entry in ranked] == [poor, fine]
    lattice_hexes = ranked[1].hexes
    assert len(lattice_hexes.hexes) == fine.polycube.occupancy.sum()
    assert np.ptp(lattice_hexes.vertices, axis=0) == pytest.approx(np.diag(SCALE) * [2, 1, 1])


def test_the_only_structure_is_not_registered_if_it_has_blocks():
    surface = part(("cube", "cube"), SCALE)
    shape = candidate(("cube", "cube"))
    hexes = mesh(shape.polycube, shape.rough_map, counts(shape.polycube, shape.rough_map, 2.0))
    exact = replace(blocks.candidate(hexes, surface, "cube", "sweep"), tier=Tier.EXACT)
    [only] = rank(surface, [exact])
    assert only.hexes is hexes and only.score == np.inf
    np.testing.assert_allclose(np.ptp(only.positions, axis=0), 1)
    both = rank(surface, [exact, shape], rounds=1)
    assert len(both) == 2 and all(np.isfinite(entry.score) for entry in both)


def test_a_structure_with_too_many_boxes_is_not_ranked(caplog):
    caplog.set_level(logging.INFO)
    surface, few = part(("cube", "cube"), SCALE), candidate(("cube", "cube"))
    overlay = replace(candidate(("cube", "cube")), tier=Tier.FINE)
    boxes = lattice(TWO, ("cube", "cube"), PRIMITIVES)
    large = replace(few, polycube=boxes, rough_map=affine_map(boxes, SCALE, np.zeros(3)))
    ranked = rank(surface, [large, overlay, few], rounds=1, boxes=50)
    assert [entry.candidate for entry in ranked] == [few, overlay]
    assert "the largest has 54 boxes, the limit is 50" in caplog.text
    [only] = rank(surface, [large], rounds=1, boxes=54)
    assert only.candidate is large


def test_cost_is_relative_to_the_proposal_and_only_the_cheapest_are_registered():
    surface = part(("cube", "cube"), SCALE)
    costs = [0.3, 0.1, 0.2]
    ours = [candidate(("cube", "cube"), cost=cost) for cost in costs]
    other = candidate(("cube", "cube"), cost=5.0, proposal="diffusion")
    ranked = rank(surface, [*ours, other], rounds=1, limit=2)
    assert [entry.candidate.cost for entry in ranked] == [0.1, 5.0, 0.2]
    assert ranked[0].score == ranked[1].score
    assert ranked[2].score - ranked[0].score == pytest.approx(15 * 0.1)


def test_of_two_candidates_with_one_rough_map_the_last_is_registered():
    first = candidate(("cube", "hole_y"))
    last = replace(first, probability=0.9)
    ranked = rank(part(("cube", "hole_y"), SCALE), [first, last], rounds=1)
    assert [entry.candidate for entry in ranked] == [last]


def test_corners_beyond_those_of_a_box_increase_the_score():
    surface = part(("cube", "hole_y"), SCALE)
    free, dear = (
        rank(surface, [candidate(("cube", "hole_y"))], rounds=1, corner=c)[0] for c in (0.0, 0.5)
    )
    assert dear.score - free.score == pytest.approx(0.5 * 8)  # those of the hole


def test_ranking_is_reproducible():
    surface = part(("hole_x", "hole_y"), SCALE)
    candidates = [candidate(("hole_x", "hole_y")), candidate(("hole_x", "hole_z"))]
    first, second = (rank(surface, candidates, rounds=2) for _ in range(2))
    assert [entry.score for entry in first] == [entry.score for entry in second]


@pytest.mark.parametrize(
    ("worse", "by"),
    [
        ({"to_surface": 1.5}, 1.5),
        ({"to_mesh": 2.0}, 2.0),
        ({"bad": 0.1}, 6.0),
        ({"mean_jacobian": 0.5}, 4.0),
        ({"volume_ratio": 0.87}, 1.5),
        ({"volume_ratio": 1.02}, 0.0),
        ({"min_jacobian": 0.6}, 0.0),
        ({"min_jacobian": -0.5}, 1.0),
    ],
)
def test_the_score_is_the_sum_of_the_defects(worse, by):
    assert short_score(PERFECT) == 0.5
    quality = ShortQuality(**{**PERFECT.__dict__, **worse})
    assert short_score(quality) == pytest.approx(0.5 + by)
