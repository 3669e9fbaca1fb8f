"""Elasticity in the space of all continuous tricubic functions on the Bezier elements of a spline.

The functions of a spline are smooth across elements, and some are constrained at the boundary; both
affect the stress more than the displacement. `corrected` starts from the solution in the spline
space and adds the missing part by conjugate gradients. The stiffness is applied element by element.
The preconditioner adds the exact solution in the spline space to a Jacobi step in the functions
that are 1 at one of 4^3 evenly spaced points of the elements and 0 at the others.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from polycube.analysis.recovery import TO_BEZIER
from polycube.spline.bernstein import gauss, volume_basis
from polycube.spline.bezier import bezier_points
from polycube.spline.boundary import FACES, unshared_faces
from polycube.types import Spline

logger = logging.getLogger(__name__)

CHUNK = 128  # elements in a batch
TOLERANCE = 1e-3  # of the initial error, in the norm of the preconditioner
ROUNDING = 1e-8  # of the forces: smaller residuals are rounding errors
MOST = 300  # largest number of iterations


@dataclass(frozen=True, eq=False)
class Elasticity:
    """Stiffness of the functions of the Bezier nodes, for a Young's modulus of 1."""

    nodes: np.ndarray  # (E, 64)
    inverse: np.ndarray  # (E, q, 3, 3) inverse Jacobian matrix at Gauss points
    volume: np.ndarray  # (E, q) volume of each Gauss point
    n_gauss: int
    poisson: float
    add: csr_matrix  # (B, 64 E) sums at the nodes

    @classmethod
    def of(cls, spline: Spline, poisson: float, n_gauss: int = 4) -> Elasticity:
        """Stiffness of the Bezier elements of a spline, with Gauss points per direction."""
        weights = gauss(n_gauss)[1]
        _, gradients = volume_basis(gauss(n_gauss)[0])
        matrix = np.einsum("aqm,emi->eqia", gradients, bezier_points(spline), optimize=True)
        nodes = spline.nodes.ravel()
        return cls(
            nodes=spline.nodes,
            inverse=np.linalg.inv(matrix),
            volume=np.linalg.det(matrix) * np.kron(np.kron(weights, weights), weights),
            n_gauss=n_gauss,
            poisson=poisson,
            add=csr_matrix(
                (np.ones(len(nodes)), (nodes, np.arange(len(nodes)))),
                (spline.extraction.shape[0], len(nodes)),
            ),
        )

    @property
    def volumes(self) -> np.ndarray:
        """(B,) integrals of the functions."""
        values, _ = volume_basis(gauss(self.n_gauss)[0])
        return self.add @ (self.volume @ values).ravel()

    @property
    def _moduli(self) -> tuple[float, float]:
        """Lame's parameters: shear modulus and lambda."""
        shear = 1 / (2 * (1 + self.poisson))
        return shear, 2 * shear * self.poisson / (1 - 2 * self.poisson)

    def forces(self, displacement: np.ndarray) -> np.ndarray:
        """(B, 3) forces K u of coefficients u (B, 3)."""
        shear, lame = self._moduli
        table = volume_basis(gauss(self.n_gauss)[0])[1].reshape(-1, 64)  # (3 q, 64)
        found = np.empty((*self.nodes.shape, 3))
        for start in range(0, len(self.nodes), CHUNK):
            own = slice(start, start + CHUNK)
            local = displacement[self.nodes[own]].transpose(1, 0, 2)  # (64, e, 3)
            slope = (table @ local.reshape(64, -1)).reshape(3, -1, *local.shape[1:])
            slope = slope.transpose(2, 1, 3, 0) @ self.inverse[own]  # (e, q, 3, 3)
            stress = shear * (slope + slope.swapaxes(2, 3))
            np.einsum("eqii->eqi", stress)[:] += lame * np.einsum("eqii->eq", slope)[..., None]
            stress *= self.volume[own][..., None, None]
            flux = (stress @ self.inverse[own].swapaxes(2, 3)).transpose(3, 1, 0, 2)
            moments = table.T @ flux.reshape(len(table), -1)
            found[own] = moments.reshape(64, -1, 3).transpose(1, 0, 2)
        return self.add @ found.reshape(-1, 3)

    def diagonal(self) -> np.ndarray:
        """(B, 3) energies of the functions that are 1 at one even point of the elements."""
        shear, lame = self._moduli
        gradients = volume_basis(gauss(self.n_gauss)[0])[1] @ TO_BEZIER
        found = np.empty((*self.nodes.shape, 3))
        for start in range(0, len(self.nodes), CHUNK):
            own = slice(start, start + CHUNK)
            slope = np.einsum("aqm,eqai->eqmi", gradients, self.inverse[own], optimize=True)
            slope **= 2
            each = (shear + lame) * slope + shear * slope.sum(axis=3, keepdims=True)
            found[own] = np.einsum("eqmi,eq->emi", each, self.volume[own])
        return self.add @ found.reshape(-1, 3)


def corrected(
    spline: Spline,
    elasticity: Elasticity,
    force: np.ndarray,
    start: np.ndarray,
    is_prescribed: np.ndarray,
    coarse: Callable[[np.ndarray], np.ndarray],
) -> np.ndarray:
    """(B, 3) Bezier coefficients of the displacement in continuous tricubic functions.

    Parameters
    ----------
    force : (B, 3) forces of the loads
    start : (B, 3) solution in the spline space
    is_prescribed : (B, 3) whether a component is prescribed at a node
    coarse : function from forces (B, 3) to the displacement (B, 3) in the spline space

    Where elements of two levels meet, only the functions of the spline connect them.
    """
    is_free = ~is_prescribed
    is_free[_between_levels(spline)] = False
    energy = elasticity.diagonal()
    step = np.where(is_free & (energy > 0), 1 / np.where(energy > 0, energy, 1), 0)
    from_even = _from_even(spline.nodes, len(force))

    def precondition(rest: np.ndarray) -> np.ndarray:
        return coarse(rest) + from_even @ (step * (from_even.T @ rest))

    resisting = elasticity.forces(start)
    found, rest = start, force - resisting
    if np.linalg.norm(rest[is_free]) <= ROUNDING * np.linalg.norm(resisting):
        return start
    better = direction = precondition(rest)
    size = (rest * better).sum()
    least = TOLERANCE**2 * size
    steps = 0
    while size > least and steps < MOST:
        against = elasticity.forces(direction)
        length = size / (direction * against).sum()
        found, rest = found + length * direction, rest - length * against
        better = precondition(rest)
        size, before = (rest * better).sum(), size
        direction = better + size / before * direction
        steps += 1
    if size > least:
        logger.warning("warning: the stress recovery did not converge in %d steps", MOST)
    logger.info("stress in continuous functions after %d steps", steps)
    return found


def _from_even(nodes: np.ndarray, size: int) -> csr_matrix:
    """(B, B) Bezier coefficients from values at evenly spaced points, numbered like the nodes."""
    used, first = np.unique(nodes, return_index=True)
    element, place = np.divmod(first, 64)
    table = np.where(abs(TO_BEZIER) > 1e-12, TO_BEZIER, 0)[place]
    row, column = np.nonzero(table)
    return csr_matrix((table[row, column], (used[row], nodes[element[row], column])), (size, size))


def _between_levels(spline: Spline) -> np.ndarray:
    """Nodes on faces that are not on the boundary and have no element on the other side."""
    unshared = unshared_faces(spline.nodes)
    inner = unshared[~np.isin(unshared @ [6, 1], spline.sides @ [6, 1])]
    return np.unique(spline.nodes[inner[:, :1], FACES[inner[:, 1]]])
