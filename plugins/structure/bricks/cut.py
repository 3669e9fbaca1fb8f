"""Full bricks of a lattice by a minimum cut.

    energy = voxels that misfit + smoothness * area of the boundary

The share of solid voxels of each brick gives the misfits. The cut is the global minimum; its
topology is corrected by `topology`.
"""

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, maximum_flow

from polycube.types import PerAxis

UNIT = 1000  # integer capacities of the cut, per mean brick
Knots = list[np.ndarray]  # three vectors in voxels, ends included


def minimum_cut(gain: np.ndarray, areas: tuple[np.ndarray, ...]) -> np.ndarray:
    """(X, Y, Z) bool of minimum energy.

    gain : (X, Y, Z) energy of an empty brick minus that of a full one
    areas : per axis, energy of a face between a full and an empty brick; (X + 1, Y, Z), (X, Y + 1,
        Z), (X, Y, Z + 1); outside is empty
    """
    index = np.arange(gain.size).reshape(gain.shape)
    source, sink = gain.size, gain.size + 1
    first, second, weight = [], [], []
    outer = np.zeros(gain.shape)
    for axis, area in enumerate(areas):
        area, at = np.moveaxis(area, axis, 0), np.moveaxis(index, axis, 0)
        pairs = at[:-1].ravel(), at[1:].ravel()
        for one, other in (pairs, pairs[::-1]):
            first.append(one)
            second.append(other)
            weight.append(area[1:-1].ravel())
        side = np.moveaxis(outer, axis, 0)
        side[0] += area[0]
        side[-1] += area[-1]
    pull = (gain - outer).ravel()
    first += [np.full(gain.size, source), index.ravel()]
    second += [index.ravel(), np.full(gain.size, sink)]
    weight += [np.maximum(pull, 0), np.maximum(-pull, 0)]
    scale = UNIT / max(np.abs(gain).mean(), 1e-300)
    capacity = np.minimum(np.round(np.concatenate(weight) * scale), 2**30).astype(np.int32)
    entries = (capacity, (np.concatenate(first), np.concatenate(second)))
    graph = coo_matrix(entries, shape=(gain.size + 2,) * 2).tocsr()
    left = graph - maximum_flow(graph, source, sink).flow
    left.data[left.data < 0] = 0
    left.eliminate_zeros()
    full = np.zeros(gain.size + 2, bool)
    full[breadth_first_order(left, source, return_predecessors=False)] = True
    return full[: gain.size].reshape(gain.shape)


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
