"""Space-filling curves: one number per cell of a cubic grid, near cells mostly near on the line.

Morton interleaves the bits of the coordinates.  Hilbert first turns them so that consecutive
numbers are always neighbours: J. Skilling, "Programming the Hilbert curve", AIP Conference
Proceedings 707 (2004), whose "transpose" form needs no tables.
"""

from __future__ import annotations

import numpy as np


def morton(cells: np.ndarray, bits: int) -> np.ndarray:
    """(...,) int64 place on the Morton curve of (..., 3) int64 cells in [0, 2^bits)."""
    places = [(axis, bit) for axis in range(3) for bit in range(bits)]
    return sum((cells[..., axis] >> bit & 1) << (3 * bit + 2 - axis) for axis, bit in places)


def hilbert(cells: np.ndarray, bits: int) -> np.ndarray:
    """(...,) int64 place on the Hilbert curve of (..., 3) int64 cells in [0, 2^bits)."""
    x = np.moveaxis(cells, -1, 0).copy()  # (3, ...)
    for bit in range(bits - 1, 0, -1):  # undo the turn of each level
        low = (1 << bit) - 1
        for axis in range(3):
            upper = x[axis] >> bit & 1 == 1
            swapped = np.where(upper, 0, (x[0] ^ x[axis]) & low)
            x[0] ^= np.where(upper, low, swapped)
            x[axis] ^= swapped
    x[1] ^= x[0]  # Gray code
    x[2] ^= x[1]
    last = x[2].copy()
    for bit in range(1, bits):
        x ^= np.where(last >> bit & 1 == 1, (1 << bit) - 1, 0)
    return morton(np.moveaxis(x, 0, -1), bits)
