"""Linear elasticity at rest: displacement, stress and reactions under loads.

K is assembled for unit diagonal and E = 1; with l metres per diagonal the stiffness in SI is E l K,
and forces on faces and volumes measured in diagonals are l^2 and l^3 times those.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from polycube.analysis.assembly import assemble
from polycube.analysis.constraints import Constraints, Support, constrain, free_rigid_motions
from polycube.analysis.material import Material
from polycube.analysis.recovery import field_of, gradient_field
from polycube.analysis.trace import trace
from polycube.errors import InputError
from polycube.numerics.factorization import factorize
from polycube.types import Deformation, Spline
from polycube.units import METRES

logger = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Load:
    """Forces on boundary faces; what is given adds up."""

    faces: np.ndarray  # (F,) into spline.sides
    pressure: float = 0.0  # Pa, towards the solid
    traction: Sequence[float] | Callable[[np.ndarray, np.ndarray], np.ndarray] = (0.0, 0.0, 0.0)
    # Pa, of points and normals (P, 3) where it varies
    force: Sequence[float] = (0.0, 0.0, 0.0)  # N, in all, evenly per area


def deform(
    spline: Spline,
    material: Material,
    supports: Sequence[Support],
    loads: Sequence[Load] = (),
    acceleration: Sequence[float] = (0.0, 0.0, 0.0),
    length_unit: str = "mm",
    n_gauss: int = 4,
) -> Deformation:
    """The solid at rest.

    supports : prescribed displacements, in the part's length unit.  acceleration : of gravity,
        m/s^2.  Stresses in Pa, forces in N, energy in J.
    Raises InputError when the supports leave rigid motions free, MeshingError where det J <= 0.
    """
    held = _held(spline, supports)
    diagonal = np.linalg.norm(np.ptp(spline.control, axis=0))
    metres = diagonal * METRES[length_unit]
    unit = replace(spline, control=spline.control / diagonal)
    stiffness, mass = assemble(unit, 1.0, material.poisson, 1.0, n_gauss)
    volume = np.asarray(mass.sum(axis=1)).ravel()  # int N_a, for the functions add up to one
    weight = material.density * metres**3 * volume
    force = weight[:, None] * np.asarray(acceleration, dtype=np.float64)
    for load in loads:
        force += _force(spline, load, METRES[length_unit])
    scaled = force.ravel() / (material.young * metres**2)  # of displacements in diagonals
    offset = held.offset / diagonal
    basis = held.basis
    factor = factorize(basis.T @ stiffness @ basis, held.points(spline))
    u = basis @ factor.solve(basis.T @ (scaled - stiffness @ offset)) + offset
    residual = (stiffness @ u - scaled) * (material.young * metres**2)
    displacement = u.reshape(-1, 3) * diagonal
    stress = gradient_field(spline, displacement, lambda slope: _stress(slope, material))
    logger.info("%d unknowns of %d", basis.shape[1], basis.shape[0])
    return Deformation(
        displacement=displacement,
        stress=stress,
        von_mises=field_of(spline, stress, von_mises),
        supports=tuple(support.name for support in supports),
        reactions=held.reactions(residual),
        load=force.sum(axis=0),
        strain_energy=float(u @ stiffness @ u) / 2 * material.young * metres**3,
        mass=float(weight.sum()),
        units={"length": length_unit, "stress": "Pa", "force": "N", "energy": "J", "mass": "kg"},
    )


def _held(spline: Spline, supports: Sequence[Support]) -> Constraints:
    """The constraints of the supports; raises InputError when they leave rigid motions free."""
    held = constrain(spline, supports, 3)
    free = free_rigid_motions(spline, held)
    if free:
        raise InputError(
            f"the supports leave {free} of 6 rigid motions free, so nothing balances the loads; "
            "fix more patches or components"
        )
    return held


def von_mises(stress: np.ndarray) -> np.ndarray:
    """(P,) equivalent stress of (P, 6) xx yy zz yz zx xy."""
    direct, shear = stress[:, :3], stress[:, 3:]
    differences = direct - np.roll(direct, 1, axis=1)
    return np.sqrt((differences**2).sum(axis=1) / 2 + 3 * (shear**2).sum(axis=1))


def _force(spline: Spline, load: Load, metres: float) -> np.ndarray:
    """(C, 3) N."""
    here = trace(spline, load.faces)
    given = load.traction
    traction = given(here.points, here.normals) if callable(given) else np.asarray(given)
    even = np.asarray(load.force, dtype=np.float64) / (here.area.sum() * metres**2)
    density = traction + even - load.pressure * here.normals
    return here.moments(density) * metres**2


def _stress(slope: np.ndarray, material: Material) -> np.ndarray:
    """(P, 6) of displacement gradients (P, 3, 3)."""
    shear = material.young / (2 * (1 + material.poisson))
    lame = 2 * shear * material.poisson / (1 - 2 * material.poisson)
    strain = (slope + slope.swapaxes(1, 2)) / 2
    dilation = np.trace(strain, axis1=1, axis2=2)[:, None, None]
    stress = 2 * shear * strain + lame * dilation * np.eye(3)
    return stress[:, [0, 1, 2, 1, 2, 0], [0, 1, 2, 2, 0, 1]]
