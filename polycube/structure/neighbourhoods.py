"""Topology of a solid of lattice cells, from the 2 x 2 x 2 cells around each lattice vertex.

The contribution of a vertex is looked up for the 256 states of its neighbourhood, which is faster
than a walk over the faces of the boundary.
"""

import numpy as np
from numba import njit
from scipy.ndimage import label


def solid_genus(occupancy: np.ndarray) -> int | None:
    """Genus of the union of boxes (X, Y, Z); None unless it is one manifold without voids."""
    full = np.pad(occupancy, 1)
    around = codes(full)
    if TABLE[around, 1].any() or label(full)[1] != 1 or label(~full)[1] != 1:
        return None
    return 1 - int(TABLE[around, 0].sum()) // 8


def defect(occupancy: np.ndarray, genus: int) -> int:
    """Number of pinched vertices, additional components, voids and wrong handles of boxes.

    It is 0 for one manifold solid without voids with this genus; at least one of the boxes
    (X, Y, Z) is full.
    """
    full = np.pad(occupancy, 1)
    total, pinched = TABLE[codes(full)].sum(axis=(0, 1, 2))
    solids, outside = label(full)[1], label(~full)[1]
    handles = solids + outside - 1 - total // 8
    return int(pinched + solids - 1 + outside - 1 + abs(handles - genus))


def euler_number(occupancy: np.ndarray) -> int:
    """V - E + F - C of the union of boxes (X, Y, Z)."""
    return int(TABLE[codes(np.pad(occupancy, 1)), 0].sum()) // 8


def codes(full: np.ndarray) -> np.ndarray:
    """(X-1, Y-1, Z-1) code of the occupied boxes around each inner vertex.

    Bit 4 x + 2 y + z belongs to box (x, y, z) of the eight.
    """
    bits = full.astype(np.uint8)
    along_x = bits[:-1] | bits[1:] << 4
    along_y = along_x[:, :-1] | along_x[:, 1:] << 2
    return along_y[..., :-1] | along_y[..., 1:] << 1


@njit(cache=True)
def flip(
    solid: np.ndarray, around: np.ndarray, i: int, j: int, k: int, table: np.ndarray
) -> tuple[int, int]:
    """Flip a cell and update the codes in place; returns the changes of the sums of the table.

    solid : cells with an empty layer around them
    around : their codes, see `codes`
    table : `TABLE`
    """
    solid[i, j, k] = not solid[i, j, k]
    total, bad = 0, 0
    for bit in range(8):
        a, b, c = i - (bit >> 2), j - (bit >> 1 & 1), k - (bit & 1)
        code = around[a, b, c]
        new = code ^ (1 << bit)
        around[a, b, c] = new
        total += table[new, 0] - table[code, 0]
        bad += table[new, 1] - table[code, 1]
    return total, bad


def _table() -> np.ndarray:
    """(256, 2) table for the codes of 2 x 2 x 2 cells.

    The columns are 8 times the contribution to the Euler number, and 1 for a pinched point.
    """
    table = np.zeros((256, 2), np.int64)
    for code in range(256):
        cells = np.array([code >> bit & 1 for bit in range(8)], bool).reshape(2, 2, 2)
        edges = sum(cells.take(s, axis).any() for axis in range(3) for s in range(2))
        faces = sum(cells.any(axis=axis).sum() for axis in range(3))
        table[code, 0] = 8 * cells.any() - 4 * edges + 2 * faces - cells.sum()
        table[code, 1] = any(label(part)[1] > 1 for part in (cells, ~cells))
    return table


TABLE = _table()
