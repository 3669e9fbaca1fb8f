"""Free vibration of an elastic solid: the lowest modes of K u = omega^2 M u, nothing held.

Solved for unit diagonal, E = 1 and density 1, by Lanczos about a shift just below zero, and scaled
to SI afterwards: omega^2 by E / (density L^2), mass by density L^3.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix, diags, eye, kron
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from polycube.spline.assembly import assemble
from polycube.types import Modes, Spline

logger = logging.getLogger(__name__)

SHIFT = -0.01  # below the elastic modes (about 1 for a compact solid) and the six zeros alike
METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254, "ft": 0.3048}


@dataclass(frozen=True)
class Material:
    """Isotropic linear elastic material in SI units."""

    young: float  # Pa
    poisson: float
    density: float  # kg/m^3

    def __post_init__(self) -> None:
        if not (self.young > 0 and self.density > 0 and -1 < self.poisson < 0.5):
            raise ValueError(
                f"material needs young > 0, density > 0 and -1 < poisson < 0.5; got {self}"
            )


MATERIALS = {
    "steel": Material(210e9, 0.30, 7850),
    "aluminium": Material(70e9, 0.33, 2700),
    "titanium": Material(114e9, 0.34, 4430),
    "brass": Material(105e9, 0.34, 8500),
    "abs": Material(2.3e9, 0.35, 1050),
}


def free_modes(
    spline: Spline,
    material: Material,
    n_modes: int = 20,
    length_unit: str = "mm",
    n_gauss: int = 4,
    lumped: bool = False,
) -> Modes:
    """The lowest modes in SI units (omega^2 in 1/s^2, mass in kg), the six rigid ones included.

    length_unit : of the control points, see METRES.  Shapes are normalised to u^T M u = 1 with M
        in kg.  n_gauss : points per direction.  lumped : row sums of M instead of M; less accurate.
    Raises ValueError when there are fewer than n_modes + 1 degrees of freedom, MeshingError where
    det J <= 0.
    """
    if not 0 < n_modes < 3 * len(spline.control):
        raise ValueError(f"modes must be in [1, {3 * len(spline.control) - 1}]; got {n_modes}")
    diagonal = np.linalg.norm(np.ptp(spline.control, axis=0))
    unit = replace(spline, control=spline.control / diagonal)
    stiffness, mass = assemble(unit, 1.0, material.poisson, 1.0, n_gauss)
    if lumped:
        mass = diags(np.asarray(mass.sum(axis=1)).ravel())
    values, vectors = lowest(stiffness, kron(mass, eye(3), "csr"), n_modes)
    length = diagonal * METRES[length_unit]
    weight = material.density * length**3
    logger.info("%d modes of %d degrees of freedom", n_modes, stiffness.shape[0])
    return Modes(
        eigenvalues=values * material.young / (material.density * length**2),
        shapes=vectors.T.reshape(n_modes, -1, 3) / np.sqrt(weight),
        mass=weight * mass.sum(),
        units={"length": length_unit, "mass": "kg", "time": "s", "frequency": "Hz"},
    )


def lowest(
    stiffness: csr_matrix, mass: csr_matrix, n_modes: int, shift: float = SHIFT
) -> tuple[np.ndarray, np.ndarray]:
    """Lowest eigenvalues (K,), ascending, and M-orthonormal vectors (N, K) of K u = lambda M u.

    Needs K - shift M positive definite: it is factored without pivoting.
    """
    factor = splu(
        (stiffness - shift * mass).tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    inverse = LinearOperator(stiffness.shape, factor.solve, dtype=np.float64)
    start = np.random.default_rng(0).standard_normal(len(factor.perm_c))
    values, vectors = eigsh(stiffness, n_modes, mass, sigma=shift, OPinv=inverse, v0=start)
    residual = stiffness @ vectors - mass @ vectors * values
    logger.info(
        "eigenvalues %.3g to %.3g, residual at most %.1e of the stiffness",
        values[0],
        values[-1],
        np.linalg.norm(residual, axis=0).max() / abs(stiffness).max(),
    )
    return values, vectors
