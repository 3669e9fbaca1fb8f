"""Full cells of a lattice, flipped until they make one manifold solid without voids."""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.ndimage import binary_dilation, label

from polycube.structure.windows import TABLE, flip, windows

ROUNDS = 20
THIN = 0.15  # share of a cell that a wall has at least where it is to fill cells
AROUND = np.ones((3, 3, 3), bool)


def manifold(share: np.ndarray, least: float) -> np.ndarray:
    """Cells of which a least share is solid, with as few others as make them one manifold solid.

    Parameters
    ----------
    share : (X, Y, Z) of each cell that is solid
    least : share from which a cell is full

    Returns
    -------
    (X, Y, Z) bool
    """
    share = _with_walls(share, least)
    full = share >= least
    for _ in range(ROUNDS):
        # first the pinches, so that blocks that touch along an edge grow together
        solid, weight = np.pad(full, 1), np.pad(np.abs(share - least), 1, constant_values=2.0)
        _mend(solid, windows(solid), weight, TABLE)
        mended = solid[1:-1, 1:-1, 1:-1]
        full = _without_voids(_largest(mended))
        if (full == mended).all():
            break
    return full


def _with_walls(share: np.ndarray, least: float) -> np.ndarray:
    """The shares, with those of walls that fill no cell raised above the least.

    A wall is where solid cells have no full cell around; two cells of it overlap what is full.
    """
    solid = (share >= THIN) & (share < least)
    apart = solid & ~binary_dilation(share >= least, AROUND)
    wall = binary_dilation(apart, AROUND, iterations=2, mask=solid) if apart.any() else apart
    return np.where(wall, (1 + least) / 2, share)


def _largest(full: np.ndarray) -> np.ndarray:
    piece, number = label(full)
    return full if number < 2 else piece == 1 + np.bincount(piece.ravel())[1:].argmax()


def _without_voids(full: np.ndarray) -> np.ndarray:
    piece, number = label(~np.pad(full, 1))
    return full if number < 2 else (piece != piece[0, 0, 0])[1:-1, 1:-1, 1:-1]


@njit(cache=True)
def _mend(solid: np.ndarray, codes: np.ndarray, weight: np.ndarray, table: np.ndarray) -> None:
    """Flip cells in place until no lattice point is pinched.

    The cell that mends most pinched points for its weight is flipped; where none mends any, all
    cells round a pinched point are filled for good.  A weight above 1 is that of a cell that stays
    as it is.
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
