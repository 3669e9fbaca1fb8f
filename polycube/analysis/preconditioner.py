"""Approximate inverse of the stiffness of a spline, from the trilinear stiffness of its hexes.

With v = B c the values at the vertices, K is close to B^T T B for the trilinear stiffness T, but up
to five times larger for the shortest waves. A share of the identity in B corrects this. With a few
Chebyshev iterations for B^-1, the eigenvalues of P K, P = B^-1 T^-1 B^-T, are about .5 to 3 on
compact solids. T, in single precision, couples 27 vertices, whereas K couples 343 functions.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix, eye
from scipy.sparse.linalg import LinearOperator

from polycube.analysis.assembly import Elements, Value, assemble_lower, assemble_scalar_lower
from polycube.analysis.constraints import Constraints
from polycube.analysis.problem import Material
from polycube.errors import MeshingError
from polycube.numerics.conjugate_gradients import (
    ITERATIONS,
    TOLERANCE,
    Operator,
    conjugate_gradients,
)
from polycube.numerics.factorization import Factor, factorize
from polycube.numerics.products import Symmetric
from polycube.types import ElementFunctions, Spline

logger = logging.getLogger(__name__)

LIMIT = 12_000  # functions above which the direct factor is more expensive
SHARE = 0.05  # share of the identity in B
STEPS = 8  # Chebyshev iterations
CORNERS = np.array([0, 3, 12, 15, 48, 51, 60, 63])  # of the 4^3 Bezier points of an element
LEAST = 1 / 27  # smallest eigenvalue of B (largest 1): means of eight with weights 2/3 and 1/3
N_GAUSS = 2  # points per direction
ORTHONORMAL = 1e-9  # largest error of products of the vectors of a basis
FEW = 60  # largest number of iterations with a direct factor
SMALL = 20_000  # unknowns below which the factor is in double precision


@dataclass(frozen=True, eq=False)
class Preconditioner:
    """Preconditioner for the free unknowns of n components; unknown i of function a is n a + i."""

    values: csr_matrix  # (C, C) B, in single precision
    turned: csr_matrix  # its transpose
    basis: csr_matrix  # (n C, free) orthonormal, from the free unknowns
    factor: Factor  # of T

    @classmethod
    def of(
        cls, model: VertexModel, stiffness: Symmetric, constraints: Constraints
    ) -> Preconditioner:
        """Preconditioner from the trilinear stiffness.

        stiffness : (n C, n C) of the trilinear hexes
        constraints : their basis is orthonormal, and vertices fulfil them like functions

        Raises ValueError unless it is positive definite.
        """
        mixed = (1 - SHARE) * model.values + SHARE * eye(len(model.vertices))
        values = csr_matrix(mixed, dtype=np.float32)
        matrix = constraints.restricted(stiffness.full())
        factor = single_precision(matrix, constraints.points(model.vertices))
        return cls(values, csr_matrix(values.T), constraints.basis.astype(np.float32), factor)

    def __call__(self, right: np.ndarray) -> np.ndarray:
        """Apply it to right-hand sides (free,) or (free, k)."""
        solved = self.factor.solve(self._unmixed(self.turned, right.reshape(len(right), -1)))
        return self._unmixed(self.values, solved).astype(np.float64).reshape(right.shape)

    def restricted(self, matrix: Symmetric | csr_matrix) -> LinearOperator:
        """Restrict a matrix (C, C) or (n C, n C) of all unknowns to the free ones."""
        number = self.basis.shape[1]
        basis = self.basis.astype(np.float64)

        def product(x: np.ndarray) -> np.ndarray:
            every = basis @ x
            return basis.T @ (matrix @ every.reshape(matrix.shape[0], -1)).reshape(every.shape)

        return LinearOperator((number, number), product, matmat=product, dtype=np.float64)

    def _unmixed(self, values: csr_matrix, right: np.ndarray) -> np.ndarray:
        """Approximate solution x (free, k) of B x = right: Saad 2003, algorithm 12.1."""
        least = (1 - SHARE) * LEAST + SHARE
        middle, half = (1 + least) / 2, (1 - least) / 2
        ratio = half / middle
        rest = right.astype(np.float32)
        step = rest / np.float32(middle)
        x = step.copy()
        for _ in range(STEPS - 1):
            every = self.basis @ step
            mixed = values @ every.reshape(values.shape[0], -1)
            rest -= self.basis.T @ mixed.reshape(every.shape)
            ratio, before = 1 / (2 * middle / half - ratio), ratio
            step = np.float32(ratio * before) * step + np.float32(2 * ratio / half) * rest
            x += step
        return x


def is_factored(spline: Spline) -> bool:
    """Whether the stiffness of a spline is factored as a whole, since it has no preconditioner."""
    return len(spline.control) < LIMIT or VertexModel.of(spline) is None


def approximate_inverse(
    spline: Spline, constraints: Constraints, solid: Material | Value, shift: float = 0.0
) -> Preconditioner | None:
    """Approximate inverse of K - shift M of an elastic solid, or of K of a conductivity.

    None if the spline has fewer than LIMIT functions, or functions that do not belong to vertices.
    """
    if len(spline.control) < LIMIT:
        return None
    model, basis = VertexModel.of(spline), constraints.basis
    if model is None or abs(basis.T @ basis - eye(basis.shape[1])).max() > ORTHONORMAL:
        return None
    try:
        if not isinstance(solid, Material):
            stiffness, _ = assemble_scalar_lower(model.elements, N_GAUSS, solid)
        else:
            stiffness, mass = assemble_lower(model.elements, solid, N_GAUSS)
            stiffness.blocks[:] -= shift * mass.blocks * np.eye(3)
    except MeshingError:  # the hexes of the vertices are worse than the spline
        return None
    return Preconditioner.of(model, stiffness, constraints)


def solvers(
    stiffness: Symmetric, constraints: Constraints, points: np.ndarray, near: Preconditioner | None
) -> tuple[Operator, Operator]:
    """The solver for forces (free,), and an approximate solver at the cost of one iteration.

    Without a preconditioner, that is the direct factor, in single precision for many unknowns.
    """
    if near is None:
        matrix = constraints.restricted(stiffness.full())
        factor = (factorize if matrix.shape[0] < SMALL else single_precision)(matrix, points)
        multiply, rough, most = matrix.dot, factor.solve, FEW
    else:
        multiply, rough, most = near.restricted(stiffness).matvec, near, ITERATIONS

    def solve(right: np.ndarray) -> np.ndarray:
        found, steps, residual = conjugate_gradients(multiply, right, rough, most)
        if residual <= TOLERANCE:
            logger.info("%d unknowns after %d steps", len(right), steps)
            return found
        if near is None:  # too ill-conditioned for single precision
            return factorize(matrix, points).solve(right)
        what = f"the solution did not converge in {steps} steps: residual {residual:.1e}"
        raise MeshingError(what)

    return solve, rough


def single_precision(matrix: csr_matrix, points: np.ndarray | None = None) -> Factor:
    """The factor in single precision, or in double precision if single precision fails."""
    try:
        return factorize(csr_matrix(matrix, dtype=np.float32), points)
    except ValueError:
        return factorize(csr_matrix(matrix, dtype=np.float64), points)


@dataclass(frozen=True, eq=False)
class VertexModel:
    """Trilinear hexes; vertices are numbered like the functions."""

    values: csr_matrix  # (C, C) B
    corners: np.ndarray  # (E, 8) vertices of each element
    vertices: np.ndarray  # (C, 3)

    @classmethod
    def of(cls, spline: Spline) -> VertexModel | None:
        """The model of a spline, or None if its functions do not belong to vertices."""
        used, corners = np.unique(spline.places[spline.nodes[:, CORNERS]], return_inverse=True)
        if len(used) != len(spline.control) or spline.level.any():
            return None
        rows = csr_matrix(spline.extraction[used])
        function = np.asarray(rows.argmax(axis=1)).ravel()
        if len(np.unique(function)) != len(function):
            return None
        values = csr_matrix(rows[np.argsort(function)])
        return cls(values, function[corners].reshape(-1, 8), values @ spline.control)

    @property
    def elements(self) -> Elements:
        """The hexes as Bezier elements."""
        line = np.array([[3, 2, 1, 0], [0, 1, 2, 3]]) / 3
        # (8, 64) Bezier coefficients of the trilinear functions of the corners
        hats = np.stack(
            [np.kron(line[z], np.kron(line[y], line[x])) for z, y, x in np.ndindex(2, 2, 2)]
        )
        order = np.argsort(self.corners, axis=1)
        functions = np.take_along_axis(self.corners, order, axis=1)
        n, at = len(functions), np.nonzero(hats)[1].reshape(8, -1)
        value = np.take_along_axis(hats, at, axis=1)
        starts = np.arange(8 * n + 1) * at.shape[1]
        matrix = csr_matrix((value[order].ravel(), at[order].ravel(), starts), (8 * n, 64))
        points = np.einsum("cm,eci->emi", hats, self.vertices[self.corners], optimize=True)
        return Elements(
            ElementFunctions(np.arange(n + 1) * 8, functions.ravel(), matrix),
            points.reshape(-1, 3),
            np.arange(64 * n).reshape(n, 64),
            len(self.vertices),
        )
