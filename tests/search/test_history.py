"""What a search knows: the outcomes, their order, and the leader."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.errors import MeshingError
from polycube.search.history import NO_MESH
from polycube.search.moves import Given
from polycube.stages import Stage
from polycube.types import Tier
from tests.fixtures.stages import START, BySize, Grow, cube, grown, history, size, structure

STAGES = [Stage("meshing/optimize", Grow())]


def add(found, scale: float, unfitted: str | None = None):
    state = replace(found.task.start, hexes=cube(scale), unfitted=unfitted)
    return found.add(Given(), state, {}, {})


def test_without_a_mesh_the_goal_is_far():
    found = history(STAGES)
    assert found.leader is None and found.shortfall == NO_MESH
    add(found, 2.5)
    assert found.shortfall == pytest.approx(0.75)
    add(found, 12.0)
    assert found.shortfall == 0


@settings(deadline=None)
@given(st.lists(st.floats(-9, 9).filter(lambda x: abs(x) > 0.1), min_size=1, max_size=9))
def test_the_leader_is_the_best_by_its_key_at_every_moment(sizes):
    found = history(STAGES)
    for number, scale in enumerate(sizes):
        outcome = add(found, scale)
        assert outcome.number == number and found.outcomes[number] is outcome
        assert found.leader.key == max(each.key for each in found.outcomes)
        assert found.leader is next(o for o in found.outcomes if o.key == found.leader.key)
    wanted = max(sizes)
    assert wanted < 0 or size(found.leader.state) == wanted


def test_inverted_hexes_are_worse_than_any_other_mesh():
    found = history(STAGES)
    inverted, small = add(found, -5.0), add(found, 0.2)
    assert (inverted.key[0], small.key[0]) == (0, 1) and found.leader is small


def test_a_mesh_that_is_not_fitted_is_not_valid():
    found = history(STAGES)
    outcome = add(found, 2.0, unfitted="it is not fitted")
    assert outcome.verdict.failures == ("it is not fitted",)
    small = history(STAGES, acceptance=BySize(least=3.0))
    outcome = add(small, 2.0, unfitted="it is not fitted")
    assert outcome.verdict.failures == ("it is not fitted", "it is too small")


def test_outcomes_belong_to_structures():
    found = history(STAGES, ranked=[structure(1.0), structure(4.0)], start=replace(START))
    one, other = (
        found.add(Given(), replace(found.start(number), hexes=cube()), {}, {}) for number in (1, 0)
    )
    assert found.of_structure(1) == [one] and found.of_structure(0) == [other]
    assert found.start(1) is found.start(1) and found.start(1).rough_map.positions.max() == 4


def test_the_only_structure_starts_from_the_task():
    found = history(STAGES, ranked=[structure(1.0), structure(4.0)])
    found.only = 1
    assert found.start(1) is found.task.start and found.start(0) is not found.task.start


def test_variants_are_those_that_a_structure_names():
    bundle = {**grown(1.0, 2.0), "own": [{"meshing/optimize": {"to": 3.0}}], "none": None}
    task = history(STAGES, bundle).task
    assert task.variants(structure(1.0, Tier.FINE, "own")) == bundle["own"]
    for name in ("portfolio", "none", "unknown"):
        assert task.variants(structure(1.0, variants=name)) == bundle["portfolio"]
    assert task.variants(None) == bundle["portfolio"]
    assert history(STAGES, {"portfolio": []}).task.variants(None) == [{}]


def test_why_there_is_no_mesh_is_said_once():
    found = history(STAGES)
    assert found.why_no_mesh == "no structure was meshed"
    found.errors += [MeshingError("no map"), MeshingError("too many"), MeshingError("no map")]
    assert found.why_no_mesh == "no map; too many"


def test_of_equal_meshes_the_first_stays():
    found = history(STAGES)
    first = add(found, 2.0)
    add(found, 2.0)
    assert found.leader is first and np.isfinite(first.key).all()
