"""Random lattices: one solid each, collapsed, with features at their stated positions."""

import numpy as np
import pytest

from polycube.diffusion.pairs.lattices import (
    KINDS,
    MOST_HANDLES,
    MOST_SLABS,
    STAYS,
    Lattice,
    random_lattice,
)
from polycube.structure.lattice import collapse, genus, is_manifold
from polycube.types import Polycube


@pytest.fixture(scope="module")
def lattices() -> list[Lattice]:
    return [random_lattice(np.random.default_rng([0, i])) for i in range(300)]


def test_each_is_one_collapsed_manifold_of_the_stated_genus(lattices: list[Lattice]) -> None:
    for each in lattices:
        shape = each.occupancy.shape
        knots = [np.arange(n + 1.0) for n in shape]
        polycube = Polycube(each.occupancy, *knots, (1, 1, 1), ("lattice",))
        assert is_manifold(polycube)
        assert 0 <= each.genus == genus(polycube) <= MOST_HANDLES
        assert max(shape) <= MOST_SLABS
        assert collapse(polycube).occupancy.shape == shape


def test_features_are_empty_or_full_boxes_that_end_where_their_kind_does(
    lattices: list[Lattice],
) -> None:
    for each in lattices:
        shape = np.array(each.occupancy.shape)
        for feature in each.features:
            low, high = np.array(feature.low), np.array(feature.high)
            assert (0 <= low).all() and (low < high).all() and (high <= shape).all()
            box = each.occupancy[tuple(map(slice, low, high))]
            assert (box == (feature.kind in STAYS)).all()
            if feature.kind == "hole":
                assert low[feature.axis] == 0 and high[feature.axis] == shape[feature.axis]


def test_they_are_of_many_kinds(lattices: list[Lattice]) -> None:
    assert {feature.kind for each in lattices for feature in each.features} == set(KINDS)
    assert {n for each in lattices for n in each.occupancy.shape} == set(range(1, MOST_SLABS + 1))
    assert {each.genus for each in lattices} >= set(range(8))
    structures = {(each.occupancy.shape, each.occupancy.tobytes()) for each in lattices}
    assert len(structures) > 200


def test_a_seed_makes_one_lattice() -> None:
    first, same = (random_lattice(np.random.default_rng(7)) for _ in range(2))
    assert np.array_equal(first.occupancy, same.occupancy)
    assert first.features == same.features


def test_shares_are_shares() -> None:
    from polycube.diffusion.pairs import lattices

    assert sum(lattices.SLABS) == pytest.approx(1)
    assert sum(share for _, share in KINDS.values()) == pytest.approx(1)
    assert sum(share for _, _, share in lattices.PROFILES.values()) == pytest.approx(1)
