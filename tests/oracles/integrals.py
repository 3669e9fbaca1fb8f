"""Integrals over the elements of a spline, element by element."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import spsolve

from polycube.spline.bernstein import gauss, tensor, volume_basis
from polycube.types import ElementFunctions, Spline
from tests.oracles.matrices import assemble_scalar

CHUNK = 64  # elements in a batch


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


def coefficients(
    spline: Spline, density: Callable[[np.ndarray], np.ndarray], n_gauss: int = 4
) -> np.ndarray:
    """(C,) of the function of the space whose moments are those of a function of points (P, 3)."""
    total = np.zeros(len(spline.control) + 1)
    for chunk in integrate(spline, spline.element_functions(), n_gauss):
        points = chunk.points.reshape(-1, 3)
        values = density(points).reshape(len(chunk.functions), -1) * chunk.root
        local = np.einsum("efq,eq->ef", chunk.shape, values)
        total += np.bincount(chunk.functions.ravel(), local.ravel(), len(total))
    return spsolve(assemble_scalar(spline, n_gauss)[1].tocsc(), total[:-1])


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
    scale = np.sqrt(weights * np.linalg.det(jacobian))  # (n, q)
    shape = (extraction @ values.T) * scale[:, None]  # (n, f, q)
    local = np.einsum("efm,aqm->eqfa", extraction, gradients, optimize=True)
    slope = local @ np.linalg.inv(jacobian) * scale[..., None, None]
    return Integrals(ids, values @ points, scale, shape, slope)
