"""Stiffness and consistent mass of linear elasticity and of -laplace u on a volumetric spline.

For each element, the gradients g of its functions at Gauss points give S[ai, bj] = int g_ai g_bj,
and K[ai, bj] = lambda S[ai, bj] + mu S[aj, bi] + mu delta_ij sum_k S[ak, bk]; the trace of S over i
= j is the matrix of the Laplacian. Elements of one colour are assembled together; their blocks are
added to the lower triangle of one sparse pattern.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from polycube.errors import MeshingError
from polycube.numerics.element_matrices import add_elements, elastic
from polycube.numerics.element_sums import colours, zero_matrices
from polycube.numerics.products import Symmetric
from polycube.numerics.threads import parts, side_by_side
from polycube.spline.bernstein import gauss, tensor, volume_basis
from polycube.types import ElementFunctions, Spline

CHUNK = 64  # elements in a batch
PAIRS = 10_000  # pairs of functions above which two threads are used


@dataclass(frozen=True)
class Integrals:
    """Integrals over a batch of elements with at most f functions each; C marks missing ones."""

    functions: np.ndarray  # (n, f)
    points: np.ndarray  # (n, q, 3) Gauss points
    root: np.ndarray  # (n, q) square root of the volume of each Gauss point
    shape: np.ndarray  # (n, f, q) N_a at the Gauss points, times this root
    slope: np.ndarray  # (n, q, f, 3) dN_a/dx_i, times this root

    @property
    def mass(self) -> np.ndarray:
        """(n, f, f) integrals of N_a N_b."""
        return self.shape @ self.shape.swapaxes(1, 2)

    @property
    def gradient(self) -> np.ndarray:
        """(n, f, 3, f, 3) integrals of dN_a/dx_i dN_b/dx_j."""
        n, q, f, _ = self.slope.shape
        flat = self.slope.reshape(n, q, 3 * f)
        return (flat.swapaxes(1, 2) @ flat).reshape(n, f, 3, f, 3)


@dataclass(frozen=True, eq=False)
class Elements:
    """Bezier elements and the functions of each."""

    functions: ElementFunctions
    points: np.ndarray  # (B, 3) Bezier points
    nodes: np.ndarray  # (E, 64) Bezier points of each element
    size: int  # total number of functions

    @classmethod
    def of(cls, spline: Spline) -> Elements:
        """The elements of a spline."""
        points = spline.extraction @ spline.control
        return cls(spline.element_functions(), points, spline.nodes, len(spline.control))


def assemble_lower(
    elements: Elements, young: float, poisson: float, density: float, n_gauss: int = 4
) -> tuple[Symmetric, Symmetric]:
    """Stiffness (3 C, 3 C) and mass (C, C); displacement i of control point a is at 3 a + i.

    The mass is the same for the three directions. n_gauss : Gauss points per direction. Raises
    MeshingError if det J <= 0 at a Gauss point.
    """
    stiffness, mass = _gradient_and_mass(elements, 3, density, n_gauss)
    shear = young / (2 * (1 + poisson))
    lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    cuts = parts(len(stiffness.blocks), PAIRS)
    side_by_side([partial(elastic, stiffness.blocks[cut], lame, shear) for cut in cuts])
    return stiffness, mass


def assemble_scalar_lower(elements: Elements, n_gauss: int = 4) -> tuple[Symmetric, Symmetric]:
    """Stiffness of -laplace u and mass, both (C, C). Raises MeshingError as `assemble_lower`."""
    return _gradient_and_mass(elements, 1, 1.0, n_gauss)


def _gradient_and_mass(
    elements: Elements, order: int, density: float, n_gauss: int
) -> tuple[Symmetric, Symmetric]:
    """Integrals of dN_a/dx_i dN_b/dx_j (order 3), or their sum over i = j (order 1), and mass."""
    t, w = gauss(n_gauss)
    values, gradients = volume_basis(t)
    tables = (
        tensor(w[None], w[None], w[None])[0],
        np.ascontiguousarray(values.T),
        np.concatenate(gradients).T.copy(),
    )
    functions = elements.functions
    gradient, mass = zero_matrices(functions, elements.size, order, 1)
    matrix = functions.coefficients
    given = (
        *(functions.offsets, functions.functions, matrix.indptr, matrix.indices, matrix.data),
        *(elements.points, elements.nodes, *tables, density),
        *(gradient.indptr, gradient.indices, gradient.blocks, mass.blocks),
    )
    for runs in colours(functions, elements.size):
        found = side_by_side(
            [partial(add_elements, runs[cut], *given) for cut in parts(len(runs), 1)]
        )
        det, element = min(found)
        if det <= 0:
            raise _inverted(det, element)
    return gradient, mass


def moments(
    spline: Spline, density: Callable[[np.ndarray], np.ndarray], n_gauss: int = 4
) -> np.ndarray:
    """(C,) integrals of N_a times a density, which is a function of points (P, 3) -> (P,)."""
    total = np.zeros(len(spline.control) + 1)
    for chunk in integrate(spline, spline.element_functions(), n_gauss):
        points = chunk.points.reshape(-1, 3)
        values = density(points).reshape(len(chunk.functions), -1) * chunk.root
        local = np.einsum("efq,eq->ef", chunk.shape, values)
        total += np.bincount(chunk.functions.ravel(), local.ravel(), len(total))
    return total[:-1]


def integrate(spline: Spline, functions: ElementFunctions, n_gauss: int) -> Iterator[Integrals]:
    """Integrate in batches of elements with equal numbers of functions."""
    order = np.argsort(np.diff(functions.offsets), kind="stable")
    for elements in np.array_split(order, len(order) // CHUNK + 1):
        yield _integrals(spline, functions, elements, n_gauss)


def _integrals(
    spline: Spline, functions: ElementFunctions, elements: np.ndarray, n_gauss: int
) -> Integrals:
    t, w = gauss(n_gauss)
    weights = tensor(w[None], w[None], w[None])[0]
    values, gradients = volume_basis(t)
    points = (spline.extraction @ spline.control)[spline.nodes[elements]]
    ids, extraction = functions.padded(elements, len(spline.control))
    jacobian = np.einsum("aqm,emi->eqia", gradients, points, optimize=True)
    scale = np.sqrt(weights * _positive_det(jacobian, elements))  # (n, q)
    shape = (extraction @ values.T) * scale[:, None]  # (n, f, q)
    local = np.einsum("efm,aqm->eqfa", extraction, gradients, optimize=True)
    slope = local @ np.linalg.inv(jacobian) * scale[..., None, None]
    return Integrals(ids, values @ points, scale, shape, slope)


def _positive_det(jacobian: np.ndarray, elements: np.ndarray) -> np.ndarray:
    det = np.linalg.det(jacobian)
    if det.min() <= 0:
        element = elements[np.unravel_index(det.argmin(), det.shape)[0]]
        raise _inverted(det.min(), int(element))
    return det


def _inverted(det: float, element: int) -> MeshingError:
    return MeshingError(
        f"analysis needs det J > 0; got {det:.3g} at a Gauss point of element {element}"
    )
