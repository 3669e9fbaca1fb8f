"""Full bricks of a lattice by a minimum cut.

    energy = voxels that misfit + smoothness * area of the boundary

The cut is the global minimum; its topology is corrected by `topology`.
"""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, maximum_flow

UNIT = 1000  # integer capacities of the cut, per mean brick


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
