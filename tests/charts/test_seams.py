import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import label

from polycube.charts.charts import seams


def quads_of(cells: np.ndarray) -> np.ndarray:
    """(Q, 4, 3) squares of a mask (I, J), in the plane x = 7."""
    corner = np.argwhere(cells)[:, None] + [[0, 0], [1, 0], [1, 1], [0, 1]]
    return np.dstack([np.full(corner.shape[:2], 7), corner]).astype(float)


def pieces(cells: np.ndarray, cuts: list[np.ndarray]) -> np.ndarray:
    """Numbers of the pieces between cuts, on a lattice of half cells."""
    open_ = np.zeros(2 * np.array(cells.shape) + 1, bool)
    for i, j in np.argwhere(cells):
        open_[2 * i + 1, 2 * j + 1] = True
    for axis in range(2):  # through the lines between two cells
        both = open_ & np.roll(open_, 2, axis)
        open_ |= np.roll(both, -1, axis)
    for cut in cuts:
        low, high = np.sort((2 * cut[[0, -1], 1:]).astype(int), axis=0)
        open_[low[0] : high[0] + 1, low[1] : high[1] + 1] = False
    return label(open_)[0][1::2, 1::2]


@pytest.mark.parametrize(
    ("cells", "number"),
    [
        (np.ones((3, 2)), 0),
        ([[1, 1], [1, 0]], 1),
        ([[1, 1, 1], [1, 0, 1], [1, 1, 1]], 4),
        ([[0, 1, 0], [1, 1, 1], [0, 1, 0]], 2),
    ],
)
def test_known_shapes(cells, number):
    assert len(seams(quads_of(np.array(cells, bool)), [1, 2])) == number


def test_the_shorter_cuts_are_chosen():
    frame = np.ones((7, 3), bool)
    frame[5, 1] = False
    cuts = seams(quads_of(frame), [1, 2])
    assert len(cuts) == 4 and all(np.ptp(cut, axis=0).tolist() == [0, 0, 1] for cut in cuts)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_pieces_are_rectangles(seed):
    cells = np.random.default_rng(seed).random((4, 5)) < 0.75
    names = label(cells)[0]
    cells = names == names[tuple(np.argwhere(cells)[0])] if cells.any() else np.ones((1, 1), bool)
    cells = cells[np.ix_(cells.any(axis=1), cells.any(axis=0))]
    cuts = seams(quads_of(cells), [1, 2])
    found = pieces(cells, cuts)
    for piece in range(1, found.max() + 1):
        at = np.argwhere(found == piece)
        assert len(at) == np.prod(np.ptp(at, axis=0) + 1)
    for cut in cuts:  # in the plane, straight, knot by knot
        assert (cut[:, 0] == 7).all()
        assert sorted(np.abs(np.diff(cut, axis=0)).sum(axis=1)) == [1.0] * (len(cut) - 1)
