"""Whether boxes are one solid, and its genus, from the 2 x 2 x 2 boxes about each lattice vertex.

The same answers as `lattice.is_manifold` and `lattice.genus`, for those who ask many times a
second: what a vertex adds is looked up among the 256 ways to fill its neighbourhood.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import label


def solid_genus(occupancy: np.ndarray) -> int | None:
    """Genus of the union of (X, Y, Z) boxes; None where it is not one manifold without voids."""
    full = np.zeros(np.add(occupancy.shape, 2), bool)
    full[1:-1, 1:-1, 1:-1] = occupancy
    around = codes(full)
    if not _IS_MANIFOLD[around].all():
        return None
    if label(full)[1] != 1 or label(~full)[1] != 1:
        return None
    return 1 - round(_EULER[around].sum())


def codes(full: np.ndarray) -> np.ndarray:
    """(X-1, Y-1, Z-1) which of the eight boxes about each inner vertex are full.

    Bit 4 x + 2 y + z is of the box (x, y, z) of the eight.
    """
    bits = full.astype(np.uint8)
    along_x = bits[:-1] | bits[1:] << 4
    along_y = along_x[:, :-1] | along_x[:, 1:] << 2
    return along_y[..., :-1] | along_y[..., 1:] << 1


def _is_manifold(full: np.ndarray) -> bool:
    """Whether the boundary of (2, 2, 2) boxes is one disc, or nothing, at their common vertex."""
    return label(full)[1] <= 1 and label(~full)[1] <= 1


def _euler(full: np.ndarray) -> float:
    """What the vertex adds to V - E + F - C: of an edge a half, of a face a quarter ..."""
    total = 0.0
    for spans in np.ndindex(2, 2, 2):  # axes along which an element at the vertex has an extent
        elements = full
        for axis, has_extent in enumerate(spans):
            if not has_extent:
                elements = np.logical_or.reduce(elements, axis=axis, keepdims=True)
        total += (-0.5) ** sum(spans) * elements.sum()
    return total


_WAYS = np.unpackbits(np.arange(256, dtype=np.uint8)[:, None], axis=1, bitorder="little")
_FULL = _WAYS.reshape(-1, 2, 2, 2).astype(bool)
_IS_MANIFOLD = np.array([_is_manifold(full) for full in _FULL])
_EULER = np.array([_euler(full) for full in _FULL])
