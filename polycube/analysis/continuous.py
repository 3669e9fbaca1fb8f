"""Elasticity in the space of all continuous tricubic functions on the Bezier elements of a spline.

The functions of a spline are smooth across elements, and some are constrained at the boundary; both
affect the stress more than the displacement. `Enrichment` adds the missing part by conjugate
gradients. The stiffness is applied element by element. The preconditioner is a Jacobi step in the
functions that are 1 at one of 4^3 evenly spaced points of the elements and 0 at the others; the
exact solution in the spline space may be added to it.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix, diags, eye, kron

from polycube.analysis.constraints import Support
from polycube.analysis.cyclic import Sector
from polycube.analysis.element_forces import elastic_forces
from polycube.analysis.problem import Material
from polycube.analysis.recovery import EVEN, TO_BEZIER, TO_BEZIER_1D, inverse, jacobians, volumes
from polycube.numerics.conjugate_gradients import Operator, conjugate_gradients
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
    """Stiffness and mass of the functions of the Bezier nodes."""

    points: np.ndarray  # (B, 3)
    nodes: np.ndarray  # (E, 64)
    volume: np.ndarray  # (E, q) volume of each Gauss point
    n_gauss: int
    solid: Material
    add: csr_matrix  # (B, 64 E) sums at the nodes
    to_bezier: np.ndarray  # (4, 4) Bezier coefficients on a line from those of the points

    @classmethod
    def of(cls, spline: Spline, solid: Material, n_gauss: int = 4) -> Elasticity:
        """Stiffness of the Bezier elements of a spline, with Gauss points per direction."""
        n_gauss = max(n_gauss, 4)  # fewer do not determine tricubic functions
        nodes = spline.nodes.ravel()
        return cls(
            points=spline.extraction @ spline.control,
            nodes=spline.nodes,
            volume=volumes(bezier_points(spline), n_gauss),
            n_gauss=n_gauss,
            solid=solid,
            add=csr_matrix(
                (np.ones(len(nodes)), (nodes, np.arange(len(nodes)))),
                (spline.extraction.shape[0], len(nodes)),
            ),
            to_bezier=np.eye(4),
        )

    def forces(self, displacement: np.ndarray) -> np.ndarray:
        """(B, 3) forces K u of coefficients u (B, 3)."""
        given = self.n_gauss, self.solid, self.to_bezier
        return elastic_forces(self.points, self.nodes, displacement, *given)

    def inertia(self, displacement: np.ndarray) -> np.ndarray:
        """(B, 3) products M u with the mass, of coefficients u (B, 3)."""
        values, _ = volume_basis(gauss(self.n_gauss)[0])
        mass = (self.solid.at().density * self.volume)[..., None]
        moved = np.einsum("qm,emi->eqi", values, displacement[self.nodes], optimize=True)
        moments = np.einsum("qm,eqi->emi", values, mass * moved, optimize=True)
        return self.add @ moments.reshape(-1, 3)

    def expansion(self, pressure: np.ndarray) -> np.ndarray:
        """(B, 3) integrals of a field p times grad N, of its coefficients p (B,)."""
        values, gradients = volume_basis(gauss(self.n_gauss)[0])
        found = np.empty((*self.nodes.shape, 3))
        for start in range(0, len(self.nodes), CHUNK):
            own = slice(start, start + CHUNK)
            turned = inverse(jacobians(self.points[self.nodes[own]], gradients))
            weight = self.volume[own] * (pressure[self.nodes[own]] @ values.T)
            found[own] = np.einsum("aqm,eqai,eq->emi", gradients, turned, weight, optimize=True)
        return self.add @ found.reshape(-1, 3)

    def diagonal(self) -> np.ndarray:
        """(B, 3) energies of the functions that are 1 at one even point of the elements."""
        gradients = volume_basis(gauss(self.n_gauss)[0])[1]
        even = gradients @ TO_BEZIER
        found = np.empty((*self.nodes.shape, 3))
        for start in range(0, len(self.nodes), CHUNK):
            own = slice(start, start + CHUNK)
            solid = self.solid.at(own)
            shear, lame = (np.reshape(m, (-1, 1, 1, 1)) for m in (solid.shear, solid.lame))
            turned = inverse(jacobians(self.points[self.nodes[own]], gradients))
            slope = np.einsum("aqm,eqai->eqmi", even, turned, optimize=True)
            slope **= 2
            each = (shear + lame) * slope + shear * slope.sum(axis=3, keepdims=True)
            found[own] = np.einsum("eqmi,eq->emi", each, self.volume[own])
        return self.add @ found.reshape(-1, 3)


@dataclass(frozen=True, eq=False)
class Enrichment:
    """The displacement that continuous tricubic functions add to one in the spline space."""

    elasticity: Elasticity
    even: Elasticity  # for `forces` of values at even points
    allowed: csr_matrix  # (3 B, 3 B) projection on the displacements that the constraints allow
    step: csr_matrix  # (3 B, 3 B) allowed part of inverse energies of functions of even points
    from_even: csr_matrix  # (B, B)
    to_even: csr_matrix  # (B, B)
    coarse: Operator | None  # from forces (B, 3) to the displacement (B, 3) in the spline space

    @classmethod
    def of(
        cls,
        spline: Spline,
        elasticity: Elasticity,
        supports: Sequence[Support],
        coarse: Operator | None = None,
        sector: Sector | None = None,
        copies: csr_matrix | None = None,
    ) -> Enrichment:
        """The enrichment of a spline with supports, and with the symmetry of a sector.

        Where elements of two levels meet, only the functions of the spline connect them.
        copies : (B', B) the nodes of the spline for those of the elasticity, if it is cut
        """
        is_free = np.ones((spline.extraction.shape[0], 3), bool)
        for support in supports:
            for component in support.components:
                is_free[support.nodes(spline), component] = False
        unshared = unshared_faces(spline.places[spline.nodes])
        inner = unshared[~np.isin(unshared @ [6, 1], spline.sides @ [6, 1])]
        is_free[spline.nodes[inner[:, :1], FACES[inner[:, 1]]]] = False
        basis = _tied(spline.places, is_free)
        if sector is not None:
            basis = sector.basis(is_free, sector.nodes)
        if copies is not None:  # which move together
            each = copies @ diags(1 / np.sqrt(copies.T @ np.ones(copies.shape[0])))
            basis = kron(each, eye(3), "csr") @ basis
        allowed = csr_matrix(basis @ basis.T)
        energy = elasticity.diagonal().ravel()
        weak = np.where(energy > 0, 1 / np.where(energy > 0, energy, 1), 0)
        step = csr_matrix(allowed @ diags(weak) @ allowed)
        from_even, to_even = (_of_elements(elasticity, each) for each in (TO_BEZIER, EVEN))
        points = to_even @ elasticity.points
        even = replace(elasticity, points=points, to_bezier=TO_BEZIER_1D)
        return cls(elasticity, even, allowed, step, from_even, to_even, coarse)

    def solve(
        self, rest: np.ndarray, most: int = MOST, tolerance: float = TOLERANCE
    ) -> tuple[np.ndarray, int, float]:
        """The displacement (B, 3) under unbalanced forces (B, 3), the steps, and the residual."""
        acting = self.from_even.T @ self.acting(rest)
        given = self.even.forces, acting, self._precondition
        even, steps, residual = conjugate_gradients(*given, most, tolerance)
        return self.from_even @ even, steps, residual

    def acting(self, forces: np.ndarray) -> np.ndarray:
        """(B, 3) the part of forces (B, 3) that moves the solid."""
        return (self.allowed @ forces.ravel()).reshape(-1, 3)

    def _precondition(self, rest: np.ndarray) -> np.ndarray:
        near = (self.step @ rest.ravel()).reshape(-1, 3)
        if self.coarse is None:
            return near
        return near + self.to_even @ self.coarse(self.to_even.T @ rest)


def corrected(enrichment: Enrichment, force: np.ndarray, start: np.ndarray) -> np.ndarray:
    """(B, 3) Bezier coefficients of the displacement in continuous tricubic functions.

    force : (B, 3) forces of the loads.  start : (B, 3) solution in the spline space
    """
    resisting = enrichment.elasticity.forces(start)
    rest = force - resisting
    if np.linalg.norm(enrichment.acting(rest)) <= ROUNDING * np.linalg.norm(resisting):
        return start
    more, steps, residual = enrichment.solve(rest)
    if residual > TOLERANCE:
        logger.warning("warning: the stress recovery did not converge in %d steps", MOST)
    logger.info("stress in continuous functions after %d steps", steps)
    return start + more


def _tied(place: np.ndarray, is_free: np.ndarray) -> csr_matrix:
    """(3 B, K) orthonormal basis of displacements that are free (B, 3), and equal at one place."""
    shares = 1 / np.sqrt(np.bincount(place)[place])
    tie = csr_matrix((shares, place, np.arange(len(place) + 1)), (len(place),) * 2)
    return kron(tie, eye(3), "csr")[:, (tie.T @ ~is_free == 0).ravel()]


def _of_elements(elasticity: Elasticity, table: np.ndarray) -> csr_matrix:
    """(B, B) a map of the nodal values of an element, (64, 64), for those of all elements."""
    nodes, size = elasticity.nodes, len(elasticity.points)
    used, first = np.unique(nodes, return_index=True)
    element, place = np.divmod(first, 64)
    table = np.where(abs(table) > 1e-12, table, 0)[place]
    row, column = np.nonzero(table)
    return csr_matrix((table[row, column], (used[row], nodes[element[row], column])), (size, size))
