"""Knots of boxes with the best fit to a voxel solid.

The number of voxels that belong to only one of a solid and a placed polycube is, for fixed knots of
two axes, a sum over slices along the third. The best knots of this axis are the cheapest division
of the slices into the slabs of the polycube, by dynamic programming. The axes are optimised in turn
until nothing changes.
"""

import numpy as np

from .alignment import cut

ROUNDS = 10  # largest number of rounds of all three axes; usually two or three are needed


def cumulative(solid: np.ndarray) -> np.ndarray:
    """(X + 1, Y + 1, Z + 1) number of solid voxels below each lattice point."""
    counts = np.pad(solid.astype(np.int64), ((1, 0), (1, 0), (1, 0)))
    for axis in range(3):
        np.cumsum(counts, axis=axis, out=counts)
    return counts


def fit_knots(slabs: np.ndarray, counts: np.ndarray, starts: int) -> tuple[list[np.ndarray], int]:
    """Voxel numbers of the knots with the best fit of (I, J, K) boxes, and the misfit in voxels.

    counts : `cumulative` voxels, which the boxes fill from end to end
    starts : number of starts of the descent; the first has equal slabs, the others random ones

    Several starts are used, because a descent that starts with a hole next to that of the part
    loses the hole.
    """
    rng = np.random.default_rng(0)
    widths = [[np.full(n, 1 / n) for n in slabs.shape]]
    widths += [[rng.dirichlet(np.full(n, 2.0)) for n in slabs.shape] for _ in range(starts - 1)]
    found = []
    for shares in widths:
        axes = zip(shares, counts.shape, strict=True)
        start = [np.append(0, share.cumsum() * (n - 1)).round().astype(int) for share, n in axes]
        found.append(descend(slabs, counts, start))
    return min(found, key=lambda pair: pair[1])


def descend(
    slabs: np.ndarray, counts: np.ndarray, knots: list[np.ndarray], shortest: int = 1
) -> tuple[list[np.ndarray], int]:
    """Knots and misfit from given knots; slabs have at least `shortest` voxels."""
    knots = list(knots)
    before = misfit = counts[-1, -1, -1] + 1
    for _ in range(ROUNDS):
        for axis in range(3):
            others = [k for other, k in enumerate(knots) if other != axis]
            cost = _slice_costs(np.moveaxis(slabs, axis, 0), np.moveaxis(counts, axis, 0), *others)
            misfit, knots[axis] = cut(range(len(cost)), dict(enumerate(cost)), shortest)
        if misfit == before:
            break
        before = misfit
    return knots, int(misfit)


def _slice_costs(slabs: np.ndarray, counts: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """(I, X) misfit in voxels of each slice along the first axis with each slab."""
    filled = np.diff(np.diff(np.diff(counts[:, y][:, :, z], axis=0), axis=1), axis=2)  # (X, J, K)
    area = np.diff(y)[:, None] * np.diff(z)
    if_empty = filled.reshape(len(filled), -1)
    if_full = (area - filled).reshape(len(filled), -1)
    full = slabs.reshape(len(slabs), -1).astype(int)
    return full @ if_full.T + (1 - full) @ if_empty.T
