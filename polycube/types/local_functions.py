"""The spline functions of each element, from the matrix rows of its nodes."""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def gathered(
    starts: np.ndarray, columns: np.ndarray, values: np.ndarray, nodes: np.ndarray, n_columns: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Transpose the matrix rows of the nodes of each element, without empty columns.

    Parameters
    ----------
    starts, columns, values : a sparse matrix by rows
    nodes : (E, n) rows of each element
    n_columns : number of columns of the matrix

    Returns
    -------
    offsets (E + 1,) and functions (R,), the columns of each element ascending, and starts (R + 1,),
    places in 0 to n - 1 and values of the rows of a sparse matrix (R, n)
    """
    seen, place = np.full(n_columns, -1), np.empty(n_columns, np.int64)
    offsets, size = np.zeros(len(nodes) + 1, np.int64), 0
    for e in range(len(nodes)):
        count = 0
        for node in nodes[e]:
            size += starts[node + 1] - starts[node]
            for c in columns[starts[node] : starts[node + 1]]:
                if seen[c] != e:
                    seen[c] = e
                    count += 1
        offsets[e + 1] = offsets[e] + count
    functions = np.empty(offsets[-1], np.int64)
    ends = np.zeros(len(functions) + 1, np.int64)
    places, found = np.empty(size, np.int64), np.empty(size, values.dtype)
    seen[:] = -1
    for e in range(len(nodes)):
        own = functions[offsets[e] : offsets[e + 1]]
        count = 0
        for node in nodes[e]:
            for c in columns[starts[node] : starts[node + 1]]:
                if seen[c] != e:
                    seen[c], place[c] = e, 0
                    own[count] = c
                    count += 1
                place[c] += 1
        own.sort()
        row = offsets[e]
        for c in own:
            ends[row + 1] = ends[row] + place[c]
            place[c] = ends[row]
            row += 1
        for local in range(nodes.shape[1]):
            node = nodes[e, local]
            for k in range(starts[node], starts[node + 1]):
                at = place[columns[k]]
                places[at], found[at] = local, values[k]
                place[columns[k]] += 1
    return offsets, functions, ends, places, found
