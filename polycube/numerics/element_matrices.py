"""Compiled integrals of products of functions and of their gradients, added to matrices."""

from functools import partial

import numpy as np
from numba import njit
from scipy.sparse import csr_matrix

from polycube.numerics.products import Symmetric
from polycube.numerics.threads import parts, side_by_side
from polycube.types import ElementFunctions

BAND = 48  # rows of products in a batch: those above the diagonal are not needed
RUN = 32  # elements that one thread adds in sequence
ROWS = 500  # functions above which two threads are used


@njit(cache=True, nogil=True)
def add_elements(
    runs: np.ndarray,
    offsets: np.ndarray,
    functions: np.ndarray,
    starts: np.ndarray,
    places: np.ndarray,
    coefficients: np.ndarray,
    points: np.ndarray,
    nodes: np.ndarray,
    weights: np.ndarray,
    values: np.ndarray,
    gradients: np.ndarray,
    density: float,
    indptr: np.ndarray,
    indices: np.ndarray,
    stiffness: np.ndarray,
    mass: np.ndarray,
) -> tuple[float, int]:
    """Add the integrals over runs of elements; returns the smallest det J and its element.

    Parameters
    ----------
    offsets, functions, starts, places, coefficients : ElementFunctions and its sparse matrix
    points, nodes : (B, 3) Bezier points, and (E, 64) those of each element
    weights, values, gradients : (q,), (64, q) and (64, 3 q), of the Bezier functions
    indptr, indices : lower triangle by rows
    stiffness : (Z, n, n) of dN_a/dx_i dN_b/dx_j for n = 3, of their sum over i = j for n = 1
    mass : (Z, 1, 1) of density N_a N_b
    """
    q, n = len(weights), stiffness.shape[1]
    least, worst, count = np.inf, -1, -1
    for element in _elements(runs, len(nodes)):
        own = functions[offsets[element] : offsets[element + 1]]
        if len(own) != count:
            count = len(own)
            extraction, shape = np.empty((count, 64)), np.empty((count, q))
            slope = np.empty((count, 3 * q))
            products = np.empty((n * count, n * count))
            masses = np.empty((count, count))
        extraction[:] = 0
        for a in range(count):
            row = offsets[element] + a
            for k in range(starts[row], starts[row + 1]):
                extraction[a, places[k]] = coefficients[k]
        at = points[nodes[element]].T.copy()
        inverse, det = _inverse(np.dot(at, gradients).reshape(3, 3, q))
        if det.min() < least:
            least, worst = det.min(), element
        if least <= 0:
            break
        root = np.sqrt(weights * det)
        np.dot(extraction, values, shape)
        shape *= np.sqrt(density) * root
        np.dot(extraction, gradients, slope)
        _to_space(slope.reshape(count, 3, q), inverse * root)
        side = slope.reshape(n * count, -1)
        for end in range(BAND, len(side) + BAND, BAND):
            products[end - BAND : end, :end] = np.dot(side[end - BAND : end], side[:end].T)
        np.dot(shape, shape.T, masses)
        _add(own, indptr, indices, products, stiffness, masses, mass)
    return least, worst


@njit(cache=True, nogil=True)
def _inverse(jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Inverse (3, 3, q), [j, i] = d xi_j / d x_i, and determinant (q,) of d x_i / d xi_j."""
    cofactor = np.empty_like(jacobian)
    for i in range(3):
        k, m = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            r, s = (j + 1) % 3, (j + 2) % 3
            cofactor[j, i] = jacobian[k, r] * jacobian[m, s] - jacobian[k, s] * jacobian[m, r]
    det = (jacobian[:, 0] * cofactor[0]).sum(axis=0)
    return cofactor / det, det


@njit(cache=True, nogil=True)
def _to_space(slope: np.ndarray, inverse: np.ndarray) -> None:
    """Convert derivatives (f, 3, q) by parameters to derivatives by coordinates."""
    for a in range(len(slope)):
        own = slope[a]
        for p in range(own.shape[1]):
            x, y, z = own[0, p], own[1, p], own[2, p]
            for i in range(3):
                own[i, p] = x * inverse[0, i, p] + y * inverse[1, i, p] + z * inverse[2, i, p]


@njit(cache=True, nogil=True)
def _add(
    own: np.ndarray,
    indptr: np.ndarray,
    indices: np.ndarray,
    products: np.ndarray,
    stiffness: np.ndarray,
    masses: np.ndarray,
    mass: np.ndarray,
) -> None:
    """Add the blocks of an element with functions (f,), ascending."""
    n = stiffness.shape[1]
    for a in range(len(own)):
        at = indptr[own[a]]
        for b in range(a + 1):
            while indices[at] < own[b]:
                at += 1
            mass[at, 0, 0] += masses[a, b]
            for i in range(n):
                for j in range(n):
                    stiffness[at, i, j] += products[a * n + i, b * n + j]


@njit(cache=True, nogil=True)
def _elements(runs: np.ndarray, number: int) -> np.ndarray:
    """Elements of runs, for a given total number."""
    found = (runs[:, None] * RUN + np.arange(RUN)).ravel()
    return found[found < number]


@njit(cache=True, nogil=True)
def elastic(blocks: np.ndarray, lame: float, shear: float) -> None:
    """Convert gradient products S[i, j] of pairs of functions (Z, 3, 3) to stiffness."""
    for pair in range(len(blocks)):
        s = blocks[pair]
        laplace = shear * (s[0, 0] + s[1, 1] + s[2, 2])
        for i in range(3):
            for j in range(i):
                upper, lower = s[j, i], s[i, j]
                s[i, j] = lame * lower + shear * upper
                s[j, i] = lame * upper + shear * lower
            s[i, i] = (lame + shear) * s[i, i] + laplace


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
