"""Elasticity in the space of all continuous tricubic functions on the Bezier elements of a spline.

The functions of a spline are smooth across elements, and some are constrained at the boundary; both
affect the stress more than the displacement. `Enrichment` adds the missing part by conjugate
gradients. The stiffness is applied element by element. The preconditioner is a Jacobi step in the
functions that are 1 at one of 4^3 Lobatto points of the elements and 0 at the others; the exact
solution in the spline space may be added to it.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import DTypeLike
from scipy.sparse import csr_matrix, diags, eye, kron

from polycube.analysis.constraints import Support
from polycube.analysis.cyclic import Sector
from polycube.analysis.element_forces import LANES, Sums, elastic_forces
from polycube.analysis.problem import Material
from polycube.analysis.recovery import inverse, jacobians, volumes
from polycube.numerics.conjugate_gradients import Operator, conjugate_gradients
from polycube.spline.bernstein import bernstein, gauss, tensor, volume_basis
from polycube.spline.boundary import FACES, unshared_faces
from polycube.types import Spline

logger = logging.getLogger(__name__)

CHUNK = 16  # batches of elements that are computed together
TOLERANCE = 1e-3  # of the initial error, in the norm of the preconditioner
ROUNDING = 1e-8  # of the forces: smaller residuals are rounding errors
MOST = 300  # largest number of iterations
SAME = np.eye(4)  # Bezier coefficients as they are
_LOBATTO = bernstein(np.array([0, 1 - 5**-0.5, 1 + 5**-0.5, 2]) / 2)
LINE = np.linalg.inv(_LOBATTO)  # Bezier coefficients on a line of values at Lobatto points
TO_LOBATTO, FROM_LOBATTO = tensor(*[_LOBATTO] * 3), tensor(*[LINE] * 3)


@dataclass(frozen=True, eq=False)
class Elasticity:
    """Stiffness and mass of the functions of the Bezier nodes."""

    points: np.ndarray  # (B, 3)
    nodes: np.ndarray  # (E, 64)
    volume: np.ndarray  # (E, q) volume of each Gauss point
    place: np.ndarray  # see `elastic_forces`
    n_gauss: int
    solid: Material
    add: csr_matrix  # (B, 64 E) sums at the nodes
    sums: Sums

    @classmethod
    def of(cls, spline: Spline, solid: Material, n_gauss: int = 4) -> Elasticity:
        """Stiffness of the Bezier elements of a spline, with Gauss points per direction."""
        n_gauss = max(n_gauss, 4)  # fewer do not determine tricubic functions
        nodes, points = spline.nodes.ravel(), spline.extraction @ spline.control
        volume, slopes = volumes(points[spline.nodes], n_gauss), volume_basis(gauss(n_gauss)[0])[1]
        place: np.ndarray = np.empty((-(-len(volume) // LANES), n_gauss**3, 9, LANES))
        for start in range(0, len(place), CHUNK):
            out = place[start : start + CHUNK]
            own = (start * LANES + np.arange(len(out) * LANES)).clip(max=len(volume) - 1)
            turned = inverse(jacobians(points[spline.nodes[own]], slopes))
            turned *= np.sqrt(abs(volume[own]))[..., None, None]
            out[:] = turned.reshape(-1, LANES, *out.shape[1:3]).transpose(0, 2, 3, 1)
        return cls(
            points=points,
            nodes=spline.nodes,
            volume=volume,
            place=place.reshape(*place.shape[:2], -1),
            n_gauss=n_gauss,
            solid=solid,
            add=csr_matrix(
                (np.ones(len(nodes)), (nodes, np.arange(len(nodes)))), (len(points), len(nodes))
            ),
            sums=Sums.at(spline.nodes, len(points)),
        )

    def forces(
        self,
        displacement: np.ndarray,
        to_bezier: np.ndarray = SAME,
        stress: np.ndarray | None = None,
    ) -> np.ndarray:
        """(B, 3) forces K u of coefficients u (B, 3); see `elastic_forces`."""
        given = self.n_gauss, self.solid, to_bezier, stress
        return elastic_forces(self.place, self.nodes, self.sums, displacement, *given)

    def inertia(self, displacement: np.ndarray) -> np.ndarray:
        """(B, 3) products M u with the mass, of coefficients u (B, 3), in the same precision."""
        kind = displacement.dtype
        values = volume_basis(gauss(self.n_gauss)[0])[0].astype(kind)
        mass = (self.solid.at().density * self.volume).astype(kind)[..., None]
        moments = np.empty((*self.nodes.shape, 3), kind)
        for start in range(0, len(moments), CHUNK * LANES):
            own = slice(start, start + CHUNK * LANES)
            moments[own] = values.T @ (mass[own] * (values @ displacement[self.nodes[own]]))
        return self.add @ moments.reshape(-1, 3)

    def expansion(self, pressure: np.ndarray) -> np.ndarray:
        """(B, 3) integrals of a field p times grad N, of its coefficients p (B,)."""
        values, gradients = volume_basis(gauss(self.n_gauss)[0])
        found = np.empty((*self.nodes.shape, 3))
        for start in range(0, len(self.nodes), CHUNK * LANES):
            own = slice(start, start + CHUNK * LANES)
            turned = inverse(jacobians(self.points[self.nodes[own]], gradients))
            weight = self.volume[own] * (pressure[self.nodes[own]] @ values.T)
            found[own] = np.einsum("aqm,eqai,eq->emi", gradients, turned, weight, optimize=True)
        return self.add @ found.reshape(-1, 3)

    def diagonal(self) -> np.ndarray:
        """(B, 3) energies of the functions that are 1 at one Lobatto point of the elements.

        They are exact in elements with parallel faces.
        """
        line, weights = gauss(self.n_gauss)
        slope = volume_basis(line)[1] @ FROM_LOBATTO
        each = np.einsum("aqm,bqm,q->mab", slope, slope, tensor(*[weights] * 3), optimize=True)
        place = self.place.reshape(len(self.place), self.n_gauss**3, 3, 3, -1)
        mean = np.einsum("zqail,zqbil->zlabi", place, place).reshape(-1, 9, 3)[: len(self.nodes)]
        shear, lame = (np.reshape(m, (-1, 1, 1)) for m in (self.solid.shear, self.solid.lame))
        mean = (shear + lame) * mean + shear * mean.sum(axis=2, keepdims=True)
        return self.add @ (each.reshape(64, 9) @ mean).reshape(-1, 3)


@dataclass(frozen=True, eq=False)
class Enrichment:
    """The displacement that continuous tricubic functions add to one in the spline space."""

    elasticity: Elasticity
    allowed: csr_matrix  # (3 B, 3 B) projection on the displacements that the constraints allow
    step: csr_matrix  # (3 B, 3 B) allowed part of inverse energies of functions of Lobatto points
    count: np.ndarray  # (B, 1) elements of each node
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
        kind: DTypeLike = float,
    ) -> Enrichment:
        """The enrichment of a spline with supports, and with the symmetry of a sector.

        Where elements of two levels meet, only the functions of the spline connect them.
        kind : precision of the conjugate gradients
        copies : (B', B) the nodes of the spline for those of the elasticity, if it is cut
        """
        is_free = np.ones((spline.extraction.shape[0], 3), bool)
        for support in supports:
            for component in support.components:
                is_free[support.nodes(spline), component] = False
        unshared = unshared_faces(spline.places[spline.nodes])
        inner = unshared[~np.isin(unshared @ [6, 1], spline.sides @ [6, 1])]
        is_free[spline.nodes[inner[:, :1], FACES[inner[:, 1]]]] = False
        # orthonormal basis (3 B, K) of displacements that are free, and equal at one place
        shares = 1 / np.sqrt(np.bincount(spline.places)[spline.places])
        tie = csr_matrix((shares, spline.places, np.arange(len(shares) + 1)), (len(shares),) * 2)
        basis = kron(tie, eye(3), "csr")[:, (tie.T @ ~is_free == 0).ravel()]
        if sector is not None:
            basis = sector.basis(is_free, sector.nodes)
        if copies is not None:  # which move together
            each = copies @ diags(1 / np.sqrt(copies.T @ np.ones(copies.shape[0])))
            basis = kron(each, eye(3), "csr") @ basis
        allowed = csr_matrix(basis @ basis.T)
        energy = elasticity.diagonal().ravel()
        weak = np.where(energy > 0, 1 / np.where(energy > 0, energy, 1), 0)
        step = csr_matrix(allowed @ diags(weak) @ allowed)
        count = np.bincount(elasticity.nodes.ravel(), minlength=len(allowed.indptr) // 3)
        elasticity = replace(elasticity, place=elasticity.place.astype(kind, copy=False))
        return cls(elasticity, allowed, step.astype(kind), count.clip(1)[:, None], coarse)

    def solve(
        self, rest: np.ndarray, most: int = MOST, tolerance: float = TOLERANCE
    ) -> tuple[np.ndarray, int, float]:
        """The displacement (B, 3) under unbalanced forces (B, 3), the steps, and the residual."""
        forces = partial(self.elasticity.forces, to_bezier=LINE)
        acting = self._sums(FROM_LOBATTO.T, self.acting(rest) / self.count)
        acting = acting.astype(self.step.dtype, copy=False)
        found, steps, residual = conjugate_gradients(
            forces, acting, self._precondition, most, tolerance
        )
        return self._sums(FROM_LOBATTO, found) / self.count, steps, residual

    def acting(self, forces: np.ndarray) -> np.ndarray:
        """(B, 3) the part of forces (B, 3) that moves the solid."""
        return (self.allowed @ forces.ravel()).reshape(-1, 3)

    def _precondition(self, rest: np.ndarray) -> np.ndarray:
        near = (self.step @ rest.ravel()).reshape(-1, 3)
        if self.coarse is None:
            return near
        rest = self._sums(TO_LOBATTO.T, rest / self.count)
        return near + self._sums(TO_LOBATTO, self.coarse(rest)) / self.count

    def _sums(self, table: np.ndarray, values: np.ndarray) -> np.ndarray:
        """(B, 3) sums over the elements of a table (64, 64) times values (B, 3) at the nodes."""
        return self.elasticity.add @ (table @ values[self.elasticity.nodes]).reshape(-1, 3)


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
