"""Genus and manifoldness by look-up, compared with a traversal of the boundary."""

import numpy as np
import pytest

from polycube.structure.lattice import boundary, genus
from polycube.structure.neighbourhoods import codes, defect, solid_genus
from polycube.surface.measures import components, edges, fans
from polycube.types import Polycube
from tests.conftest import first_quick


def polycube(occupancy: np.ndarray) -> Polycube:
    knots = [np.arange(n + 1.0) for n in occupancy.shape]
    return Polycube(occupancy, *knots, (1, 1, 1), ("boxes",))


def is_manifold(solid: Polycube) -> bool:
    """Two faces at each edge, one fan of faces around each vertex, and one piece."""
    if not solid.occupancy.any():
        return False
    quads = boundary(solid).quads
    if (edges(quads)[1] != 2).any():
        return False
    return components(quads).max() == 0 and fans(quads).max() + 1 == len(np.unique(quads))


def genus_by_counting(solid: Polycube) -> int:
    """1 - (V - E + F - C), counted from the elements."""
    euler = 0
    for collapsed in np.ndindex(2, 2, 2):  # axes along which the lattice element has no extent
        elements = np.pad(solid.occupancy, 1)
        for axis in np.flatnonzero(collapsed):
            slabs = np.moveaxis(elements, axis, 0)
            elements = np.moveaxis(slabs[1:] | slabs[:-1], 0, axis)
        euler += (-1) ** (3 - sum(collapsed)) * int(elements.sum())
    return 1 - euler


def test_a_box_a_ring_a_void_and_boxes_that_touch_in_a_point_or_edge() -> None:
    block = np.ones((3, 3, 3), bool)
    ring, void = block.copy(), block.copy()
    ring[1, 1], void[1, 1, 1] = False, False
    assert solid_genus(block) == 0
    assert solid_genus(ring) == 1
    assert solid_genus(void) is None
    for second in ((1, 1, 1), (1, 1, 0), (2, 0, 0)):
        pair = np.zeros((3, 3, 3), bool)
        pair[0, 0, 0] = pair[second] = True
        assert solid_genus(pair) is None
    assert solid_genus(np.zeros((2, 2, 2), bool)) is None


def test_defects_are_counted() -> None:
    """Voids, additional components, wrong handles, and pinched vertices."""
    block = np.ones((3, 3, 3), bool)
    ring, void, two = block.copy(), block.copy(), block.copy()
    ring[1, 1], void[1, 1, 1], two[1] = False, False, False
    assert [defect(block, 0), defect(block, 2), defect(ring, 1), defect(ring, 0)] == [0, 2, 0, 1]
    assert [defect(void, 0), defect(two, 0)] == [1, 1]
    touching = np.zeros((2, 2, 1), bool)
    touching[0, 0] = touching[1, 1] = True
    assert defect(touching, 0) > 0


@pytest.mark.parametrize("seed", first_quick(1, range(4)))
def test_equal_to_the_boundary_of_random_boxes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    found = 0
    for share in np.tile([0.2, 0.5, 0.75, 0.9, 0.95], 40):
        occupancy = rng.random(rng.integers(1, 5, 3)) < share
        counted = genus_by_counting(polycube(occupancy))
        expected = counted if is_manifold(polycube(occupancy)) else None
        assert genus(polycube(occupancy)) == counted
        assert solid_genus(occupancy) == expected
        found += expected is not None
    assert found > 20


def test_codes_describe_the_boxes_around_a_vertex() -> None:
    occupancy = np.zeros((2, 1, 1), bool)
    occupancy[1] = True
    found = codes(np.pad(occupancy, 1))
    assert found.shape == (3, 2, 2)
    assert found[1, 0, 0] == 2**7 and found[2, 0, 0] == 2**3 and found[1, 1, 1] == 2**4
    assert not found[0].any()
