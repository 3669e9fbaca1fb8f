"""Functions that share an element, and elements that share no function.

A matrix that is a sum over elements has a block for each pair of functions that share one. Elements
are grouped in short runs, because neighbours often have consecutive numbers. Runs of one colour
share no function: their blocks can be added on several threads, and the sums do not depend on the
number of threads.
"""

from functools import partial

import numpy as np
from numba import njit
from scipy.sparse import csr_matrix

from polycube.numerics.products import Symmetric
from polycube.numerics.threads import parts, side_by_side
from polycube.types import ElementFunctions

RUN = 32  # elements that one thread adds in sequence
ROWS = 500  # functions above which two threads are used


def zero_matrices(functions: ElementFunctions, size: int, *orders: int) -> list[Symmetric]:
    """Zero matrices with a common pattern for `size` functions, with blocks of the given orders."""
    starts, elements = _elements_of(functions.offsets, functions.functions, size)
    given = (functions.offsets, functions.functions, starts, elements)
    rows = side_by_side([partial(_partners, *given, c.start, c.stop) for c in parts(size, ROWS)])
    indptr = np.cumsum([0, *np.concatenate([count for count, _ in rows])])
    indices = np.concatenate([partners for _, partners in rows])
    return [Symmetric(indptr, indices, np.zeros((len(indices), n, n))) for n in orders]


def colours(functions: ElementFunctions, size: int) -> list[np.ndarray]:
    """Runs of each colour, ascending; run r has the elements r RUN to (r + 1) RUN."""
    ends = functions.offsets[::RUN]
    offsets = ends if ends[-1] == functions.offsets[-1] else np.append(ends, functions.offsets[-1])
    runs = _elements_of(offsets, functions.functions, size)
    colour = _colour(offsets, functions.functions, *runs)
    order = np.argsort(colour, kind="stable")
    return np.split(order, np.cumsum(np.bincount(colour))[:-1])


def _elements_of(
    offsets: np.ndarray, functions: np.ndarray, size: int
) -> tuple[np.ndarray, np.ndarray]:
    """Start of the elements of each function (C + 1,), and the elements."""
    shape = (len(offsets) - 1, size)
    has = csr_matrix((np.ones(len(functions), bool), functions, offsets), shape).tocsc()
    return has.indptr, has.indices


@njit(cache=True, nogil=True)
def _partners(
    offsets: np.ndarray,
    functions: np.ndarray,
    starts: np.ndarray,
    elements: np.ndarray,
    first: int,
    last: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Number of columns of each row from `first` to `last`, and the columns up to the row."""
    count = np.zeros(last - first, np.int64)
    most = 0
    for element in elements[starts[first] : starts[last]]:
        most += offsets[element + 1] - offsets[element]
    columns, size = np.empty(most, np.int32), 0
    seen = np.full(last, -1)
    for row in range(first, last):
        start = size
        for element in elements[starts[row] : starts[row + 1]]:
            for column in functions[offsets[element] : offsets[element + 1]]:
                if column <= row and seen[column] != row:
                    seen[column] = row
                    columns[size] = column
                    size += 1
        columns[start:size].sort()
        count[row - first] = size - start
    return count, columns[:size].copy()


@njit(cache=True, nogil=True)
def _colour(
    offsets: np.ndarray, functions: np.ndarray, starts: np.ndarray, elements: np.ndarray
) -> np.ndarray:
    """(E,) the smallest colour without an earlier element that shares a function."""
    n = len(offsets) - 1
    colour = np.full(n, n)
    taken = np.full(n + 1, -1)  # the last element that cannot have the colour
    for element in range(n):
        for function in functions[offsets[element] : offsets[element + 1]]:
            for other in elements[starts[function] : starts[function + 1]]:
                taken[colour[other]] = element
        colour[element] = 0
        while taken[colour[element]] == element:
            colour[element] += 1
    return colour
