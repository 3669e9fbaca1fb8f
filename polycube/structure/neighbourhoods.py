"""Manifold test and genus of boxes, from the 2 x 2 x 2 boxes around each lattice vertex.

The contribution of a vertex is looked up for the 256 states of its neighbourhood, which is faster
than a walk over the faces of the boundary.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import label


def solid_genus(occupancy: np.ndarray) -> int | None:
    """Genus of the union of boxes (X, Y, Z); None unless it is one manifold without voids."""
    full = _padded(occupancy)
    around = codes(full)
    if not _IS_MANIFOLD[around].all():
        return None
    if label(full)[1] != 1 or label(~full)[1] != 1:
        return None
    return 1 - round(_EULER[around].sum())


def euler_number(occupancy: np.ndarray) -> int:
    """V - E + F - C of the union of boxes (X, Y, Z)."""
    return round(_EULER[codes(_padded(occupancy))].sum())


def _padded(occupancy: np.ndarray) -> np.ndarray:
    """With empty boxes on all sides; faster than np.pad."""
    full = np.zeros(np.add(occupancy.shape, 2), bool)
    full[1:-1, 1:-1, 1:-1] = occupancy
    return full


def codes(full: np.ndarray) -> np.ndarray:
    """(X-1, Y-1, Z-1) code of the occupied boxes around each inner vertex.

    Bit 4 x + 2 y + z belongs to box (x, y, z) of the eight.
    """
    bits = full.astype(np.uint8)
    along_x = bits[:-1] | bits[1:] << 4
    along_y = along_x[:, :-1] | along_x[:, 1:] << 2
    return along_y[..., :-1] | along_y[..., 1:] << 1


def _is_manifold(full: np.ndarray) -> bool:
    """Whether the boundary of (2, 2, 2) boxes at their common vertex is one disc or empty."""
    return label(full)[1] <= 1 and label(~full)[1] <= 1


def _euler(full: np.ndarray) -> float:
    """Contribution of the vertex to V - E + F - C: half of an edge, a quarter of a face, etc."""
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
