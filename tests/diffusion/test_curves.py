"""Curves against slow versions and the property that defines them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.diffusion.curves import hilbert, morton

CELL = st.integers(0, 1023)


@settings(derandomize=True, max_examples=50, deadline=None)
@given(cell=st.tuples(CELL, CELL, CELL))
def test_morton_interleaves_bit_by_bit(cell: tuple[int, int, int]) -> None:
    words = [f"{c:010b}" for c in cell]
    slow = int("".join(x + y + z for x, y, z in zip(*words, strict=True)), 2)
    assert morton(np.array(cell), 10) == slow


@pytest.mark.parametrize("bits", [1, 2, 3, 4])
def test_both_number_every_cell_once(bits: int) -> None:
    cells = np.indices([2**bits] * 3).reshape(3, -1).T
    for curve in (morton, hilbert):
        assert np.array_equal(np.sort(curve(cells, bits)), np.arange(8**bits))


@pytest.mark.parametrize("bits", [1, 2, 3, 4])
def test_consecutive_cells_of_hilbert_are_neighbours(bits: int) -> None:
    cells = np.indices([2**bits] * 3).reshape(3, -1).T
    walk = cells[np.argsort(hilbert(cells, bits))]
    assert walk[0].tolist() == [0, 0, 0]
    assert (np.abs(np.diff(walk, axis=0)).sum(axis=1) == 1).all()


@settings(derandomize=True, max_examples=50, deadline=None)
@given(cell=st.tuples(CELL, CELL, CELL), level=st.integers(1, 9))
def test_hilbert_visits_one_octant_after_the_other(cell: tuple[int, int, int], level: int) -> None:
    """At every level the cells of an octant are one block of 8^level places."""
    corner = np.array(cell) >> level << level
    far = corner + (1 << level) - 1
    assert hilbert(np.array(cell), 10) >> 3 * level == hilbert(corner, 10) >> 3 * level
    assert hilbert(np.array(cell), 10) >> 3 * level == hilbert(far, 10) >> 3 * level


def test_cells_are_not_changed() -> None:
    cells = np.random.default_rng(0).integers(0, 1024, (4, 5, 3))
    before = cells.copy()
    assert hilbert(cells, 10).shape == morton(cells, 10).shape == (4, 5)
    assert np.array_equal(cells, before)
