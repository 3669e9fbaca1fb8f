"""Vibration of an elastic solid: the lowest modes of K u = omega^2 M u, free or held on patches.

Solved for unit diagonal, E = 1 and density 1, by Lanczos about a shift just below zero, and scaled
to SI afterwards: omega^2 by E / (density L^2), mass by density L^3.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse import csr_matrix, diags, eye, kron
from scipy.sparse.linalg import LinearOperator, eigsh

from polycube.io.units import METRES
from polycube.spline.assembly import assemble
from polycube.spline.constraints import Support, constrain, free_rigid_motions
from polycube.spline.factorization import factorize
from polycube.spline.material import Material
from polycube.types import Modes, Spline

logger = logging.getLogger(__name__)

SHIFT = -0.01  # below the elastic modes (about 1 for a compact solid) and the six zeros alike


def free_modes(
    spline: Spline,
    material: Material,
    n_modes: int = 20,
    length_unit: str = "mm",
    n_gauss: int = 4,
    lumped: bool = False,
    supports: Sequence[Support] = (),
) -> Modes:
    """The lowest modes in SI units (omega^2 in 1/s^2, mass in kg), rigid ones included.

    length_unit : of the control points, see METRES.  Shapes are normalised to u^T M u = 1 with M
        in kg.  n_gauss : points per direction.  lumped : row sums of M instead of M; less accurate.
    supports : where components of the displacement are zero
    Raises ValueError when there are fewer than n_modes + 1 degrees of freedom, MeshingError where
    det J <= 0.
    """
    held = constrain(spline, supports, 3)
    if not 0 < n_modes < held.basis.shape[1]:
        raise ValueError(f"modes must be in [1, {held.basis.shape[1] - 1}]; got {n_modes}")
    diagonal = np.linalg.norm(np.ptp(spline.control, axis=0))
    unit = replace(spline, control=spline.control / diagonal)
    stiffness, mass = assemble(unit, 1.0, material.poisson, 1.0, n_gauss)
    if lumped:
        mass = diags(np.asarray(mass.sum(axis=1)).ravel())
    basis = held.basis
    inertia = kron(mass, eye(3), "csr")
    if supports:
        stiffness, inertia = (csr_matrix(basis.T @ a @ basis) for a in (stiffness, inertia))
    values, vectors = lowest(stiffness, inertia, n_modes, points=held.points(spline))
    length = diagonal * METRES[length_unit]
    weight = material.density * length**3
    logger.info("%d modes of %d degrees of freedom", n_modes, stiffness.shape[0])
    return Modes(
        eigenvalues=values * material.young / (material.density * length**2),
        shapes=(basis @ vectors).T.reshape(n_modes, -1, 3) / np.sqrt(weight),
        mass=weight * mass.sum(),
        units={"length": length_unit, "mass": "kg", "time": "s", "frequency": "Hz"},
        rigid=min(n_modes, free_rigid_motions(spline, held)),
    )


def lowest(
    stiffness: csr_matrix,
    mass: csr_matrix,
    n_modes: int,
    shift: float = SHIFT,
    points: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Lowest eigenvalues (K,), ascending, and M-orthonormal vectors (N, K) of K u = lambda M u.

    points : (N, 3) where each unknown is, see `factorize`
    Raises ValueError unless K - shift M is positive definite.
    """
    factor = factorize(stiffness - shift * mass, points)
    inverse = LinearOperator(stiffness.shape, factor.solve, dtype=np.float64)
    start = np.random.default_rng(0).standard_normal(stiffness.shape[0])
    values, vectors = eigsh(stiffness, n_modes, mass, sigma=shift, OPinv=inverse, v0=start)
    residual = stiffness @ vectors - mass @ vectors * values
    logger.info(
        "eigenvalues %.3g to %.3g, residual at most %.1e of the stiffness",
        values[0],
        values[-1],
        np.linalg.norm(residual, axis=0).max() / abs(stiffness).max(),
    )
    return values, vectors
