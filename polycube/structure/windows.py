"""Topology of a solid of lattice cells, from the 2 x 2 x 2 cells around each lattice point."""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.ndimage import label


def _table() -> np.ndarray:
    """(256, 3) table for each 2 x 2 x 2 window.

    The columns are 8 times the contribution to the Euler number; 1 for a pinched point; 1 for a
    corner of the boundary, i.e. if the window is not symmetric along any axis.
    """
    table = np.zeros((256, 3), np.int64)
    for code in range(256):
        window = np.array([code >> bit & 1 for bit in range(8)], bool).reshape(2, 2, 2)
        edges = sum(window.take(s, axis).any() for axis in range(3) for s in range(2))
        faces = sum(window.any(axis=axis).sum() for axis in range(3))
        table[code, 0] = 8 * window.any() - 4 * edges + 2 * faces - window.sum()
        table[code, 1] = any(label(part)[1] > 1 for part in (window, ~window))
        table[code, 2] = all((window.take(0, a) != window.take(1, a)).any() for a in range(3))
    return table


TABLE = _table()


def windows(solid: np.ndarray) -> np.ndarray:
    """Code of the 2 x 2 x 2 cells around each lattice point: bit 4a + 2b + c for cell (a, b, c)."""
    codes = np.zeros(np.array(solid.shape) - 1, np.int64)
    for bit, (a, b, c) in enumerate(np.ndindex(2, 2, 2)):
        nx, ny, nz = codes.shape
        codes |= solid[a : nx + a, b : ny + b, c : nz + c].astype(np.int64) << bit
    return codes


@njit(cache=True)
def flip(
    solid: np.ndarray, codes: np.ndarray, i: int, j: int, k: int, table: np.ndarray
) -> tuple[int, int]:
    """Flip a cell and update the windows in place; returns the changes of the sums of the table.

    solid : cells with an empty layer around them
    codes : codes of the windows, see `windows`
    table : `TABLE`
    """
    solid[i, j, k] = not solid[i, j, k]
    total, bad = 0, 0
    for bit in range(8):
        a, b, c = i - (bit >> 2), j - (bit >> 1 & 1), k - (bit & 1)
        code = codes[a, b, c]
        new = code ^ (1 << bit)
        codes[a, b, c] = new
        total += table[new, 0] - table[code, 0]
        bad += table[new, 1] - table[code, 1]
    return total, bad
