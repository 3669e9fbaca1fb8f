"""Full cells of a lattice, flipped until they are one manifold solid without voids."""

import numpy as np
from numba import njit
from scipy.ndimage import binary_dilation, binary_fill_holes, label

from polycube.structure.neighbourhoods import TABLE, codes, flip

ROUNDS = 20
THIN = 0.15  # smallest share of a cell in a wall that fills cells
AROUND = np.ones((3, 3, 3), bool)


def manifold(share: np.ndarray, least: float) -> np.ndarray:
    """Cells with a smallest solid share, and as few changes as needed for a manifold solid.

    Parameters
    ----------
    share : (X, Y, Z) solid share of each cell
    least : share above which a cell is full

    Returns
    -------
    (X, Y, Z) bool
    """
    share = _with_walls(share, least)
    full = share >= least
    for _ in range(ROUNDS):
        # first the pinched points, so that blocks that touch along an edge are connected
        solid, weight = np.pad(full, 1), np.pad(np.abs(share - least), 1, constant_values=2.0)
        _repair(solid, codes(solid), weight, TABLE)
        inner = solid[1:-1, 1:-1, 1:-1]
        full = binary_fill_holes(_largest(inner))
        if (full == inner).all():
            break
    return full


def _with_walls(share: np.ndarray, least: float) -> np.ndarray:
    """The shares, with those of walls without full cells raised above the limit.

    A wall consists of solid cells without full cells around them; two of its cells overlap full
    ones.
    """
    solid = (share >= THIN) & (share < least)
    apart = solid & ~binary_dilation(share >= least, AROUND)
    wall = binary_dilation(apart, AROUND, iterations=2, mask=solid) if apart.any() else apart
    return np.where(wall, (1 + least) / 2, share)


def _largest(full: np.ndarray) -> np.ndarray:
    piece, number = label(full)
    return full if number < 2 else piece == 1 + np.bincount(piece.ravel())[1:].argmax()


@njit(cache=True)
def _repair(solid: np.ndarray, codes: np.ndarray, weight: np.ndarray, table: np.ndarray) -> None:
    """Flip cells in place until no lattice point is pinched.

    The cell that repairs the most pinched points for its weight is flipped; if none repairs any,
    all cells around a pinched point are filled permanently. A weight above 1 marks a fixed cell.
    """
    while True:
        bad = np.argwhere(table[codes.ravel(), 1].reshape(codes.shape) > 0)
        if len(bad) == 0:
            return
        for n in range(len(bad)):
            a, b, c = bad[n]
            if table[codes[a, b, c], 1] == 0:
                continue
            best, chosen = 0.0, -1
            for bit in range(8):
                i, j, k = a + (bit >> 2), b + (bit >> 1 & 1), c + (bit & 1)
                if weight[i, j, k] > 1:
                    continue
                gain = -flip(solid, codes, i, j, k, table)[1]
                flip(solid, codes, i, j, k, table)
                if gain / (0.05 + weight[i, j, k]) > best:
                    best, chosen = gain / (0.05 + weight[i, j, k]), bit
            for bit in range(8):
                i, j, k = a + (bit >> 2), b + (bit >> 1 & 1), c + (bit & 1)
                if bit == chosen or (chosen < 0 and weight[i, j, k] <= 1 and not solid[i, j, k]):
                    flip(solid, codes, i, j, k, table)
                    if chosen < 0:
                        weight[i, j, k] = 2.0
