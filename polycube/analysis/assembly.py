"""Stiffness and consistent mass of linear elasticity and of -laplace u on a volumetric spline.

Per element the gradients g of its functions at Gauss points give S[ai, bj] = int g_ai g_bj, and
K[ai, bj] = lambda S[ai, bj] + mu S[aj, bi] + mu delta_ij sum_k S[ak, bk]; its trace over i = j is
the Laplacian's.  Elements go through in chunks of similar function counts; their blocks are added
into one sparse pattern.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.sparse import bsr_matrix, csr_matrix

from polycube.errors import MeshingError
from polycube.spline.bernstein import gauss, tensor, volume_basis
from polycube.spline.bezier import bezier_points
from polycube.types import ElementFunctions, Spline

CHUNK = 64  # elements at a time
BLOCKS = 100_000  # pairs of functions at a time


@dataclass(frozen=True)
class Integrals:
    """Over a chunk of elements with at most f functions each, the absent ones numbered C."""

    functions: np.ndarray  # (n, f)
    points: np.ndarray  # (n, q, 3) Gauss points
    root: np.ndarray  # (n, q) root of the volume of each
    shape: np.ndarray  # (n, f, q) N_a at the Gauss points, times the root of their volume
    slope: np.ndarray  # (n, q, f, 3) dN_a/dx_i, likewise

    @property
    def mass(self) -> np.ndarray:
        """(n, f, f) of N_a N_b."""
        return self.shape @ self.shape.swapaxes(1, 2)

    @property
    def gradient(self) -> np.ndarray:
        """(n, f, 3, f, 3) of dN_a/dx_i dN_b/dx_j."""
        n, q, f, _ = self.slope.shape
        flat = self.slope.reshape(n, q, 3 * f)
        return (flat.swapaxes(1, 2) @ flat).reshape(n, f, 3, f, 3)

    @property
    def laplace(self) -> np.ndarray:
        """(n, f, f) of grad N_a . grad N_b."""
        n, q, f, _ = self.slope.shape
        flat = self.slope.swapaxes(2, 3).reshape(n, 3 * q, f)
        return flat.swapaxes(1, 2) @ flat


def assemble(
    spline: Spline, young: float, poisson: float, density: float, n_gauss: int = 4
) -> tuple[bsr_matrix, csr_matrix]:
    """Stiffness (3 C, 3 C), displacement i of control point a at 3 a + i, and mass (C, C).

    The mass is the same for the three directions.  n_gauss : Gauss points per direction.
    Raises MeshingError where det J <= 0 at a Gauss point.
    """
    functions = spline.element_functions()
    pattern = _Pattern.of(functions, len(spline.control))
    stiffness, mass = pattern.zeros(3), pattern.zeros(1)
    for chunk in integrate(spline, functions, n_gauss):
        pattern.add(stiffness, chunk.functions, chunk.gradient.swapaxes(2, 3))
        pattern.add(mass, chunk.functions, density * chunk.mass[..., None, None])
    for rows in np.array_split(stiffness, len(stiffness) // BLOCKS + 1):
        rows[:] = _elastic(rows, young, poisson)
    return pattern.matrix(stiffness), pattern.matrix(mass).tocsr()


def assemble_scalar(spline: Spline, n_gauss: int = 4) -> tuple[csr_matrix, csr_matrix]:
    """Stiffness of -laplace u and mass, both (C, C).  Raises MeshingError as `assemble`."""
    functions = spline.element_functions()
    pattern = _Pattern.of(functions, len(spline.control))
    laplace, mass = pattern.zeros(1), pattern.zeros(1)
    for chunk in integrate(spline, functions, n_gauss):
        pattern.add(laplace, chunk.functions, chunk.laplace[..., None, None])
        pattern.add(mass, chunk.functions, chunk.mass[..., None, None])
    return pattern.matrix(laplace).tocsr(), pattern.matrix(mass).tocsr()


def moments(
    spline: Spline, density: Callable[[np.ndarray], np.ndarray], n_gauss: int = 4
) -> np.ndarray:
    """(C,) integrals of N_a times a density, which takes points (P, 3) and gives (P,)."""
    total = np.zeros(len(spline.control) + 1)
    for chunk in integrate(spline, spline.element_functions(), n_gauss):
        points = chunk.points.reshape(-1, 3)
        values = density(points).reshape(len(chunk.functions), -1) * chunk.root
        local = np.einsum("efq,eq->ef", chunk.shape, values)
        total += np.bincount(chunk.functions.ravel(), local.ravel(), len(total))
    return total[:-1]


def _elastic(gradient: np.ndarray, young: float, poisson: float) -> np.ndarray:
    """(Z, 3, 3) stiffness from the gradient products S[i, j] of pairs of functions."""
    shear = young / (2 * (1 + poisson))
    lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    laplace = np.trace(gradient, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    return lame * gradient + shear * (gradient.swapaxes(1, 2) + laplace)


def integrate(spline: Spline, functions: ElementFunctions, n_gauss: int) -> Iterator[Integrals]:
    """Integrate chunk by chunk, elements with equally many functions together."""
    t, w = gauss(n_gauss)
    weights = tensor(w[None], w[None], w[None])[0]
    values, gradients = volume_basis(t)
    points = bezier_points(spline)
    order = np.argsort(np.diff(functions.offsets), kind="stable")
    for elements in np.array_split(order, len(order) // CHUNK + 1):
        ids, extraction = functions.padded(elements, len(spline.control))
        jacobian = np.einsum("aqm,emi->eqia", gradients, points[elements], optimize=True)
        scale = np.sqrt(weights * _positive_det(jacobian, elements))  # (n, q)
        shape = (extraction @ values.T) * scale[:, None]  # (n, f, q)
        local = np.einsum("efm,aqm->eqfa", extraction, gradients, optimize=True)
        slope = local @ np.linalg.inv(jacobian) * scale[..., None, None]
        yield Integrals(ids, values @ points[elements], scale, shape, slope)


def _positive_det(jacobian: np.ndarray, elements: np.ndarray) -> np.ndarray:
    det = np.linalg.det(jacobian)
    if det.min() <= 0:
        element = elements[np.unravel_index(det.argmin(), det.shape)[0]]
        raise MeshingError(
            f"analysis needs det J > 0; got {det.min():.3g} at a Gauss point of element {element}"
        )
    return det


@dataclass(frozen=True)
class _Pattern:
    """Pairs of functions that share an element, by rows."""

    indptr: np.ndarray  # (C + 1,)
    indices: np.ndarray  # (Z,) ascending in each row

    @classmethod
    def of(cls, functions: ElementFunctions, size: int) -> _Pattern:
        """The pattern of all elements, for `size` functions."""
        has = csr_matrix(
            (np.ones(len(functions.functions), bool), functions.functions, functions.offsets),
            (len(functions.offsets) - 1, size),
        )
        pairs = (has.T @ has).tocsr()
        pairs.sort_indices()
        return cls(pairs.indptr, pairs.indices)

    def zeros(self, n: int) -> np.ndarray:
        """(Z, n, n) blocks."""
        return np.zeros((len(self.indices), n, n))

    def add(self, total: np.ndarray, functions: np.ndarray, blocks: np.ndarray) -> None:
        """Add blocks (e, f, f, n, n) of elements with functions (e, f) to a total (Z, n, n)."""
        _add(self.indptr, self.indices, functions, blocks, total)

    def matrix(self, blocks: np.ndarray) -> bsr_matrix:
        """(n C, n C) of blocks (Z, n, n)."""
        size = blocks.shape[1] * (len(self.indptr) - 1)
        return bsr_matrix((blocks, self.indices, self.indptr), (size, size))


@njit(cache=True, nogil=True)
def _add(
    indptr: np.ndarray,
    indices: np.ndarray,
    functions: np.ndarray,
    blocks: np.ndarray,
    total: np.ndarray,
) -> None:
    size, n = len(indptr) - 1, total.shape[1]
    for element in range(len(functions)):
        present = functions[element]
        for a in range(len(present)):
            row = present[a]
            if row == size:
                continue
            first, last = indptr[row], indptr[row + 1]
            for b in range(len(present)):
                if present[b] < size:
                    at = first + np.searchsorted(indices[first:last], present[b])
                    for i in range(n):
                        for j in range(n):
                            total[at, i, j] += blocks[element, a, b, i, j]
