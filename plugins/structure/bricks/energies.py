"""Bricks between knots: solid share of each, and the energy of filling them."""

from collections.abc import Sequence

import numpy as np

from polycube.types import PerAxis

Knots = list[np.ndarray]  # three vectors in voxels, ends included


def largest_genus(knots: Sequence[np.ndarray]) -> int:
    """Approximate number of handles that bricks between knots can have: a hole needs 3 x 3."""
    x, y, z = ((len(k) - 2) // 2 for k in knots)
    return 2 * (x * y + y * z + z * x)


def filled_and_size(
    counts: np.ndarray, knots: Sequence[np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """(X, Y, Z) number of solid voxels in each brick, and number of all its voxels."""
    filled = counts[np.ix_(*knots)]
    for axis in range(3):
        filled = np.diff(filled, axis=axis)
    x, y, z = (np.diff(k) for k in knots)
    return filled, x[:, None, None] * y[:, None] * z


def energies(
    counts: np.ndarray, knots: Knots, fill: float, smoothness: float
) -> tuple[np.ndarray, PerAxis]:
    """Gains of full bricks and costs of faces for `minimum_cut`, as shares of the volume."""
    total = counts[-1, -1, -1]
    filled, size = filled_and_size(counts, knots)
    x, y, z = (np.diff(k) for k in knots)
    weight = smoothness / total ** (2 / 3)
    faces = (y[:, None] * z)[None], (x[:, None] * z)[:, None], (x[:, None] * y)[:, :, None]
    along_x, along_y, along_z = (
        np.repeat(face, len(k), axis=axis) * weight
        for axis, (face, k) in enumerate(zip(faces, knots, strict=True))
    )
    return 2 * (filled - fill * size) / total, (along_x, along_y, along_z)
