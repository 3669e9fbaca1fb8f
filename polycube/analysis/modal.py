"""Vibration of an elastic solid: the lowest modes of K u = omega^2 M u, free or supported.

The problem is solved for unit diagonal, mean E = 1 and mean density 1, and scaled to SI units:
omega^2 by E / (density L^2), mass by density L^3. The modes are computed in double precision, with
a Cholesky factor of K - shift M in single precision as preconditioner, for a shift slightly below
zero; in large models with an approximate inverse.
"""

import logging
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import diags, eye, kron, spmatrix

from polycube.analysis import recovery
from polycube.analysis.assembly import Elements, assemble_lower
from polycube.analysis.constraints import Constraints, Support, constrain, free_rigid_motions
from polycube.analysis.continuous import Elasticity, Enrichment
from polycube.analysis.cyclic import Sector
from polycube.analysis.peaks import poor_elements
from polycube.analysis.preconditioner import approximate_inverse, single_precision
from polycube.analysis.problem import Cyclic, Material
from polycube.analysis.shape import distance_error
from polycube.numerics.davidson import davidson
from polycube.numerics.threads import side_by_side
from polycube.types import Modes, Spline
from polycube.units import METRES

logger = logging.getLogger(__name__)

SHIFT = -0.01  # below the elastic modes (about 1 for a compact solid) and the six zeros
TOLERANCE = 1e-5  # of the modes of large models, see `davidson`
# further modes, whose corrected frequency may be among the lowest, in small and in large models
SPARE = 4, 2
STEPS, RESIDUAL = 10, 0.05  # of conjugate gradients for what continuous functions add: limits
# estimated error of an eigenvalue: a factor of the squared error of the stress in the energy norm,
# and a share of the correction, of which a few steps do not find all
SAFETY, REST = 1.5, 0.175
TINY = np.finfo(float).tiny
DENSE = 10  # unknowns per mode up to which dense matrices are used


def free_modes(
    spline: Spline,
    material: Material,
    n_modes: int = 20,
    length_unit: str = "mm",
    n_gauss: int = 4,
    lumped: bool = False,
    supports: Sequence[Support] = (),
    enrich: bool = False,
    cyclic: Cyclic | None = None,
) -> Modes:
    """The lowest modes in SI units (omega^2 in 1/s^2, mass in kg), including rigid ones.

    Shapes are normalised to u^T M u = 1 with M in kg. Raises ValueError if there are fewer than
    n_modes + 1 degrees of freedom, and MeshingError if det J <= 0.

    material : that of the solid, or with values (E,) of the elements
    length_unit : unit of the control points, see METRES
    n_gauss : Gauss points per direction
    lumped : use the row sums of M instead of M; less accurate
    supports : prescribed zero components of the displacement
    enrich : frequencies in all continuous tricubic functions, and their errors; the shapes remain
        those of the spline
    cyclic : the part is a sector; the modes are those with the symmetry of the whole
    """
    sector = None if cyclic is None else Sector.of(spline, cyclic)
    constraints = constrain(spline, supports, 3, sector)
    if not 0 < n_modes < constraints.basis.shape[1]:
        raise ValueError(f"modes must be in [1, {constraints.basis.shape[1] - 1}]; got {n_modes}")
    diagonal = np.linalg.norm(np.ptp(spline.control, axis=0))
    unit = replace(spline, control=spline.control / diagonal, offset=spline.offset / diagonal)
    solid, young, density = material.scaled()
    given = unit, solid, n_gauss, constraints
    values, shapes, each = _in_spline_space(*given, n_modes, lumped, enrich)
    rigid = min(len(values), free_rigid_motions(spline, constraints))
    errors = np.zeros(0)
    if enrich:
        values, errors = _enriched(*given, values, shapes, rigid)
        order = np.argsort(values, kind="stable")[:n_modes]
        values, shapes, errors = values[order], shapes[order], errors[order]
    length = diagonal * METRES[length_unit]
    weight = density * length**3
    logger.info("%d modes of %d degrees of freedom", n_modes, constraints.basis.shape[1])
    return Modes(
        eigenvalues=values * young / (density * length**2),
        shapes=shapes / np.sqrt(weight),
        mass=weight * each.sum(),
        units={"length": length_unit, "mass": "kg", "time": "s", "frequency": "Hz"},
        rigid=min(rigid, n_modes),
        errors=tuple(errors[rigid:].tolist()),
    )


def _in_spline_space(
    spline: Spline,
    solid: Material,
    n_gauss: int,
    constraints: Constraints,
    n_modes: int,
    lumped: bool,
    has_spare: bool,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Eigenvalues (K,), and shapes (K, C, 3) of the spline, with the mass (C,) of each function."""
    stiffness, mass = assemble_lower(Elements.of(spline), solid, n_gauss)
    each = mass @ np.ones(mass.shape[0])
    near = approximate_inverse(spline, constraints, solid, SHIFT)
    spare = SPARE[near is not None] if has_spare else 0
    number = min(n_modes + spare, constraints.basis.shape[1] - 1)
    inertia = diags(each, format="csr") if lumped else mass.full().tocsr()
    if near is None:
        free = constraints.restricted(stiffness.full())
        free_inertia = constraints.restricted(kron(inertia, eye(3), "csr"))
        values, vectors = lowest(free, free_inertia, number, constraints.points(spline.control))
    else:
        both = near.restricted(stiffness), near.restricted(inertia)
        values, vectors = davidson(*both, near, number, SHIFT, TOLERANCE)
    return values, (constraints.basis @ vectors).T.reshape(number, -1, 3), each


def _enriched(
    spline: Spline,
    solid: Material,
    n_gauss: int,
    constraints: Constraints,
    values: np.ndarray,
    shapes: np.ndarray,
    rigid: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues (K,) in all continuous tricubic functions, and errors (K,) of frequencies.

    A few steps of conjugate gradients find most of what these functions add to a mode. The part
    orthogonal to this mode and the lower ones gives a smaller eigenvalue by the method of Ritz.
    The error of an eigenvalue is the squared error of its mode in the energy norm, which is
    estimated from the stress (Zienkiewicz and Zhu 1987), also where the stress is singular. A share
    of the correction, what the method of Ritz leaves out, which is of second order in the
    correction, and the effect of the distance of the boundary are added.
    """
    elasticity = Elasticity.of(spline, solid, n_gauss)
    held = constraints.supports, None, constraints.sector
    enrichment = Enrichment.of(spline, elasticity, *held, kind=np.float32)
    poor, nodes, volume = poor_elements(spline), spline.nodes, elasticity.volume
    root = np.sqrt(abs(volume)).astype(np.float32)[..., None]
    carry = recovery.barlow(elasticity.n_gauss).astype(np.float32)

    def estimated(i: int) -> tuple[float, float, float]:
        """The eigenvalue of a mode, and its errors from the stress and from the distance."""
        value, moved = values[i], spline.extraction @ shapes[i]
        resisting = elasticity.forces(moved)
        rest = value * elasticity.inertia(moved) - resisting
        more, _, _ = enrichment.solve(rest, STEPS, RESIDUAL)
        lower, heavy = shapes[: i + 1], elasticity.inertia(more.astype(np.float32))
        shares = np.einsum("kcd,cd->k", lower, spline.extraction.T @ heavy)
        mass = max(float((more * heavy).sum() - (shares**2).sum()), TINY)
        more -= spline.extraction @ np.tensordot(shares, lower, 1)
        moved += more
        stress = np.empty((*volume.shape, 6), np.float32)
        own = (more * (elasticity.forces(moved, stress=stress) - resisting)).sum() / mass
        coupled = (more * resisting).sum() ** 2 / mass
        apart = max(own - value, 0) / 2
        stress /= root
        mean = recovery.shared(spline, carry @ stress, poor)
        lost = value * recovery.energy_error(nodes, stress, mean, volume, solid.work)[0] ** 2
        off = 0.0
        if len(spline.offset):
            fields = np.column_stack([mean, value * (moved**2).sum(axis=1)]).astype(np.float32)
            off = float(distance_error(spline, recovery.field_of(spline, fields, solid.gain)))
        return value + apart - np.sqrt(apart**2 + coupled), lost, off

    found, (lost, off) = values.copy(), np.zeros((2, len(values)))
    each = side_by_side([partial(estimated, i) for i in range(rigid, len(values))])
    found[rigid:], lost[rigid:], off[rigid:] = np.reshape(each, (-1, 3)).T
    size, gain = values.clip(TINY), values - found
    return found, (SAFETY * lost + gain * (REST + gain / size / 2) + off) / size / 2


def lowest(
    stiffness: spmatrix, mass: spmatrix, n_modes: int, points: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Lowest eigenvalues (K,), ascending, and M-orthonormal vectors (N, K) of K u = lambda M u.

    points : (N, 3) position of each unknown, see `factorize`

    Raises ValueError unless K - SHIFT M is positive definite.
    """
    if stiffness.shape[0] <= DENSE * n_modes:
        values, vectors = eigh(stiffness.toarray(), mass.toarray())
        if values[0] <= SHIFT:
            raise ValueError("matrix is not positive definite")
        return values[:n_modes], vectors[:, :n_modes]
    factor = single_precision(stiffness - SHIFT * mass, points)
    return davidson(stiffness, mass, factor.solve, n_modes, SHIFT)
