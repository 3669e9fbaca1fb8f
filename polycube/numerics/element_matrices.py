"""Compiled integrals of elasticity, conduction and mass over elements, added to matrices."""

import numpy as np
from numba import njit
from scipy.sparse import csr_matrix, tril

from polycube.numerics.products import Symmetric
from polycube.types import ElementFunctions

BAND = 48  # rows of products in a batch: those above the diagonal are not needed
RUN = 32  # elements that one thread adds in sequence


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
    moduli: np.ndarray,
    indptr: np.ndarray,
    indices: np.ndarray,
    stiffness: np.ndarray,
    mass: np.ndarray,
) -> tuple[float, int]:
    """Add the integrals over runs of elements; returns the smallest det J and its element.

    offsets, functions, starts, places, coefficients : ElementFunctions and its sparse matrix
    points, nodes : (B, 3) Bezier points, and (E, 64) those of each element
    weights, values, gradients : (q,), (64, q) and (64, 3 q), of the Bezier functions
    moduli : (E, 3) first parameter of Lame, or conductivity for n = 1; shear modulus; density
    indptr, indices : lower triangle by rows
    stiffness : (Z, n, n) for n = 3 components, or of -div k grad u for n = 1
    mass : (Z, 1, 1) of N_a N_b times the density
    """
    q, n = len(weights), stiffness.shape[1]
    least, worst, count = np.inf, -1, -1
    for run in runs:
        for element in range(run * RUN, min((run + 1) * RUN, len(nodes))):
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
                return least, worst
            root = np.sqrt(weights * det)
            np.dot(extraction, values, shape)
            shape *= root
            np.dot(extraction, gradients, slope)
            _to_space(slope.reshape(count, 3, q), inverse * root)
            side = slope.reshape(n * count, -1)
            for start in range(0, len(side), BAND):
                band = np.dot(side[start : start + BAND], side[: start + BAND].T)
                for r in range(band.shape[0]):
                    for c in range(band.shape[1]):
                        products[start + r, c] = band[r, c]
            np.dot(shape, shape.T, masses)
            _add(own, indptr, indices, products, stiffness, masses, mass, moduli[element])
    return least, worst


@njit(cache=True, nogil=True)
def _inverse(jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Inverse (3, 3, q), [j, i] = d xi_j / d x_i, and determinant (q,) of d x_i / d xi_j."""
    cofactor = np.empty_like(jacobian)
    for i in range(3):
        k, m = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            a, b, c, d = jacobian[k], jacobian[m], (j + 1) % 3, (j + 2) % 3
            for p in range(jacobian.shape[2]):
                cofactor[j, i, p] = a[c, p] * b[d, p] - a[d, p] * b[c, p]
    own = cofactor[0]
    det = jacobian[0, 0] * own[0] + jacobian[1, 0] * own[1] + jacobian[2, 0] * own[2]
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
    moduli: np.ndarray,
) -> None:
    """Add the blocks of an element with functions (f,), ascending, and with moduli (3,)."""
    n, (lame, shear, density) = stiffness.shape[1], moduli
    for a in range(len(own)):
        at = indptr[own[a]]
        for b in range(a + 1):
            while indices[at] < own[b]:
                at += 1
            mass[at, 0, 0] += density * masses[a, b]
            r, c = a * n, b * n
            for i in range(n):
                for j in range(n):
                    both = lame * products[r + i, c + j] + shear * products[r + j, c + i]
                    stiffness[at, i, j] += both
                    stiffness[at, j, j] += shear * products[r + i, c + i]


def zero_matrices(functions: ElementFunctions, size: int, *orders: int) -> list[Symmetric]:
    """Zero matrices with a common pattern for `size` functions, with blocks of the given orders."""
    has = _incidence(functions, size, functions.offsets)
    lower = tril(has.T @ has, format="csr")
    lower.sort_indices()
    return [Symmetric(lower.indptr, lower.indices, np.zeros((lower.nnz, n, n))) for n in orders]


def colours(functions: ElementFunctions, size: int) -> list[np.ndarray]:
    """Runs of each colour, ascending; run r has the elements r RUN to (r + 1) RUN.

    The colour of a run is the first one without an earlier run that shares a function.
    """
    ends = np.append(functions.offsets[:-1:RUN], functions.offsets[-1])
    has = _incidence(functions, size, ends)
    near = csr_matrix(has @ has.T)
    colour = np.full(len(ends) - 1, -1)
    for run, others in enumerate(np.split(near.indices, near.indptr[1:-1])):
        colour[run] = np.setdiff1d(np.arange(len(others) + 1), colour[others])[0]
    return np.split(np.argsort(colour, kind="stable"), np.cumsum(np.bincount(colour))[:-1])


def _incidence(functions: ElementFunctions, size: int, ends: np.ndarray) -> csr_matrix:
    """Whether elements, or runs of them, have each function; their functions are between `ends`."""
    columns = functions.functions.copy()  # `sum_duplicates` changes them
    has = csr_matrix((np.ones(len(columns), bool), columns, ends), (len(ends) - 1, size))
    has.sum_duplicates()
    return has
