"""Linear elastic statics: displacement, stress and reactions under loads.

K is assembled for unit diagonal and E = 1. With l metres per diagonal, the stiffness in SI units is
E l K, and forces on faces and volumes measured in diagonals are l^2 and l^3 times those.
Reactions are computed in the spline space; displacement and stress in the space of all continuous
tricubic functions, starting from the displacement in the spline space.
"""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.sparse import eye

from polycube.analysis.assembly import Elements, assemble_lower
from polycube.analysis.boundary_sets import trace
from polycube.analysis.constraints import Constraints, Support, constrain, free_rigid_motions
from polycube.analysis.continuous import Elasticity, Enrichment, corrected
from polycube.analysis.peaks import Singular, peaks, poor_elements, singular_places
from polycube.analysis.preconditioner import elastic_preconditioner, solvers
from polycube.analysis.problem import Material
from polycube.analysis.recovery import at_places, field_of, gradient_field, samples
from polycube.analysis.shape import distance_error
from polycube.errors import InputError
from polycube.spline.bernstein import gauss, volume_basis
from polycube.types import Deformation, Spline
from polycube.units import METRES

logger = logging.getLogger(__name__)

# factor of the estimated error of displacements: that of the work of the loads is the square of the
# error of the stress in the energy norm
SAFETY = 3.0
TINY = np.finfo(float).tiny


@dataclass(frozen=True, eq=False)
class Load:
    """Forces on boundary faces; the contributions are added."""

    faces: np.ndarray  # (F,) indices of spline.sides
    pressure: float = 0.0  # Pa, positive towards the solid
    traction: Sequence[float] | Callable[[np.ndarray, np.ndarray], np.ndarray] = (0.0, 0.0, 0.0)
    # Pa, or a function of points and normals (P, 3)
    force: Sequence[float] = (0.0, 0.0, 0.0)  # N, total force, distributed evenly by area


def deform(
    spline: Spline,
    material: Material,
    supports: Sequence[Support],
    loads: Sequence[Load] = (),
    acceleration: Sequence[float] = (0.0, 0.0, 0.0),
    length_unit: str = "mm",
    n_gauss: int = 4,
    away: float = 0.02,
) -> Deformation:
    """The deformed solid: stresses in Pa, forces in N, energy in J.

    Raises InputError if the supports leave rigid motions free, and MeshingError if det J <= 0.

    supports : prescribed displacements in the length unit of the part
    acceleration : gravity in m/s^2
    away : distance from a singular place, in diagonals, within which points belong to it
    """
    constraints = _supported(spline, supports)
    diagonal = np.linalg.norm(np.ptp(spline.control, axis=0))
    metres = diagonal * METRES[length_unit]
    unit = replace(spline, control=spline.control / diagonal)
    stiffness, _ = assemble_lower(Elements.of(unit), 1.0, material.poisson, 1.0, n_gauss)
    elasticity = Elasticity.of(unit, material.poisson, n_gauss)
    points = spline.extraction @ spline.control
    # the same solid with one function for each Bezier node
    nodal = replace(spline, control=points, extraction=eye(len(points), format="csr"))
    weight = material.density * metres**3 * elasticity.volumes
    on_nodes = weight[:, None] * np.asarray(acceleration, dtype=np.float64)
    for load in loads:
        on_nodes += _force(nodal, load, METRES[length_unit])
    scaled = on_nodes / (material.young * metres**2)  # for displacements in diagonals
    force = (spline.extraction.T @ scaled).ravel()
    basis, offset = constraints.basis, constraints.offset / diagonal
    near = elastic_preconditioner(unit, constraints, material.poisson)
    solve, rough = solvers(stiffness, constraints, constraints.points(spline), near)

    def coarse(rest: np.ndarray) -> np.ndarray:
        forces = basis.T @ (spline.extraction.T @ rest).ravel()
        return spline.extraction @ (basis @ rough(forces)).reshape(-1, 3)

    u = basis @ solve(basis.T @ (force - stiffness @ offset)) + offset
    residual = (stiffness @ u - force) * (material.young * metres**2)
    logger.info("%d unknowns of %d", basis.shape[1], basis.shape[0])
    own = spline.extraction @ u.reshape(-1, 3)
    moved = corrected(Enrichment.of(unit, elasticity, supports, coarse), scaled, own)
    energy = (moved * elasticity.forces(moved)).sum() / 2
    radius = away * diagonal
    work = float(energy) * material.young * metres**3
    gravity = material.density * np.asarray(acceleration, dtype=np.float64)
    apart = _distance_error(spline, material, moved * diagonal, gravity * METRES[length_unit])
    singular = singular_places(spline, supports, [load.faces for load in loads], radius)
    return Deformation(
        displacement=moved * diagonal,
        supports=tuple(support.name for support in supports),
        reactions=constraints.reactions(residual),
        load=on_nodes.sum(axis=0),
        strain_energy=work,
        mass=float(weight.sum()),
        units={"length": length_unit, "stress": "Pa", "force": "N", "energy": "J", "mass": "kg"},
        **_stresses(
            spline,
            material,
            moved * diagonal,
            elasticity,
            singular,
            radius,
            apart * METRES[length_unit] ** 3 / max(2 * work, TINY),
        ),
    )


def _distance_error(
    spline: Spline, material: Material, displacement: np.ndarray, gravity: np.ndarray
) -> float:
    """Error of the compliance by the distance from the part, in Pa times cubed units of the part.

    gravity : (3,) weight of a volume, times the length unit
    """
    work = gradient_field(spline, displacement, material.work, poor_elements(spline))[:, 0]
    return distance_error(spline, 2 * displacement @ gravity - work)


def _stresses(
    spline: Spline,
    material: Material,
    displacement: np.ndarray,
    elasticity: Elasticity,
    singular: Sequence[Singular],
    radius: float,
    apart: float,
) -> dict[str, Any]:
    """The stresses and errors of a Deformation for a displacement (B, 3).

    apart : estimated relative error of the compliance by the distance from the part
    """

    def equivalent_of(slope: np.ndarray) -> np.ndarray:
        return von_mises(material.stress(slope))[:, None]

    poor = poor_elements(spline)
    stress = gradient_field(spline, displacement, material.stress, poor)
    equivalent = field_of(spline, stress, von_mises)
    largest = peaks(spline, displacement, equivalent, equivalent_of, poor, singular, radius)
    line = gauss(elasticity.n_gauss)[0]
    raw = at_places(spline, displacement, material.stress, line)
    recovered = volume_basis(line)[0] @ stress[spline.nodes]
    off = _relative(recovered - raw, recovered, elasticity)
    most = np.linalg.norm(samples(spline, displacement), axis=2).max()
    return {
        "stress": stress,
        "von_mises": equivalent,
        "peak": largest[0],
        "singular": largest[1],
        "poor": int(poor.sum()),
        "stress_error": off,
        "displacement_error": (SAFETY * off**2 + apart) * float(most),
    }


def _relative(rest: np.ndarray, stress: np.ndarray, elasticity: Elasticity) -> float:
    """Energy norm of stresses (E, q, 6) at the Gauss points, relative to that of others."""
    poisson = elasticity.poisson

    def energy(of: np.ndarray) -> float:
        squares = (of[..., :3] ** 2).sum(axis=2) + 2 * (of[..., 3:] ** 2).sum(axis=2)
        density = (1 + poisson) * squares - poisson * of[..., :3].sum(axis=2) ** 2
        return float((elasticity.volume * density).sum())

    return float(np.sqrt(energy(rest) / max(energy(stress), TINY)))


def _supported(spline: Spline, supports: Sequence[Support]) -> Constraints:
    """The constraints of the supports; raises InputError if they leave rigid motions free."""
    constraints = constrain(spline, supports, 3)
    free = free_rigid_motions(spline, constraints)
    if free:
        raise InputError(
            f"the supports leave {free} of 6 rigid motions free, so the loads are not balanced; "
            "fix more patches or components"
        )
    return constraints


def von_mises(stress: np.ndarray) -> np.ndarray:
    """(P,) equivalent stress of stresses (P, 6) xx yy zz yz zx xy."""
    direct, shear = stress[:, :3], stress[:, 3:]
    differences = direct - np.roll(direct, 1, axis=1)
    return np.sqrt((differences**2).sum(axis=1) / 2 + 3 * (shear**2).sum(axis=1))


def _force(spline: Spline, load: Load, metres: float) -> np.ndarray:
    """(C, 3) nodal forces in N."""
    here = trace(spline, load.faces)
    given = load.traction
    traction = given(here.points, here.normals) if callable(given) else np.asarray(given)
    even = np.asarray(load.force, dtype=np.float64) / (here.area.sum() * metres**2)
    density = traction + even - load.pressure * here.normals
    return here.moments(density) * metres**2
