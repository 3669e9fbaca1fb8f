"""The shape of a curve by its points: a line, an arc of a circle, or any other."""

from __future__ import annotations

import numpy as np

EXACT = 1e-5  # of the curve's extent: how far its points may be off


def shape_of(points: np.ndarray) -> str:
    """Name the shape of a polyline.

    Parameters
    ----------
    points : (N, 3), at least 2; of a circle they lie on it

    Returns
    -------
    "line", "circle" (an arc of one or the whole) or "curve"
    """
    middle = points - points.mean(axis=0)
    extent, axes = np.linalg.svd(middle, full_matrices=False)[1:]
    across = abs(middle @ axes.T).max(axis=0)
    if across[1:].max(initial=0) <= EXACT * extent[0]:
        return "line"
    if len(points) < 5 or across[2] > EXACT * extent[0]:
        return "curve"
    flat = middle @ axes[:2].T
    square = (flat**2).sum(axis=1)  # |p - c|^2 = r^2 is linear in c and r^2 - |c|^2
    solved = np.linalg.lstsq(np.column_stack([2 * flat, np.ones(len(flat))]), square, rcond=None)[0]
    radius = np.sqrt(solved[2] + solved[:2] @ solved[:2])
    off = abs(np.linalg.norm(flat - solved[:2], axis=1) - radius).max()
    return "circle" if off <= EXACT * extent[0] else "curve"
