"""Linear elastic statics: displacement, stress and reactions under loads.

K is assembled for unit diagonal and E = 1. With l metres per diagonal, the stiffness in SI units is
E l K, and forces on faces and volumes measured in diagonals are l^2 and l^3 times those.
Reactions are computed in the spline space; displacement and stress in the space of all continuous
tricubic functions, starting from the displacement in the spline space. A temperature T enters by
the stress sigma(epsilon) - c T of a solid that expands, with c = (3 lambda + 2 mu) alpha.
"""

import logging
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.sparse import eye

from polycube.analysis import recovery
from polycube.analysis.assembly import Elements, assemble_lower
from polycube.analysis.boundary_sets import faces_of, trace
from polycube.analysis.constraints import Support, constrain, free_rigid_motions
from polycube.analysis.continuous import Elasticity, Enrichment, corrected
from polycube.analysis.cyclic import Sector
from polycube.analysis.loads import NOTHING, Load, at_points
from polycube.analysis.peaks import Singular, peaks, poor_elements, singular_places
from polycube.analysis.preconditioner import approximate_inverse, solvers
from polycube.analysis.preloads.preload import Preload
from polycube.analysis.preloads.sections import Cut
from polycube.analysis.problem import EQUAL, Cyclic, Material, Rotation
from polycube.analysis.shape import distance_error
from polycube.errors import InputError
from polycube.spline.bernstein import gauss, volume_basis
from polycube.types import Deformation, Spline
from polycube.units import METRES

logger = logging.getLogger(__name__)


def deform(
    spline: Spline,
    material: Material,
    supports: Sequence[Support],
    loads: Sequence[Load] = (),
    acceleration: Sequence[float] = NOTHING,
    length_unit: str = "mm",
    n_gauss: int = 4,
    away: float = 0.02,
    rotation: Rotation | None = None,
    temperature: float | str = 0.0,
    cyclic: Cyclic | None = None,
    preloads: Sequence[Preload] = (),
) -> Deformation:
    """The deformed solid: stresses in Pa, forces in N, energy in J.

    Raises InputError if the supports leave rigid motions free or a preload has no section, and
    MeshingError if det J <= 0.

    material : that of the solid, or with values (E,) of the elements
    supports : prescribed displacements in the length unit of the part
    acceleration : gravity in m/s^2
    away : distance from a singular place, in diagonals, within which points belong to it
    temperature : in K above that without stress; a number or an expression, see `loads.at_points`
    cyclic : the part is a sector, and each sector has the same loads, turned with it
    """
    sector = None if cyclic is None else Sector.of(spline, cyclic)
    constraints = constrain(spline, supports, 3, sector)
    free = free_rigid_motions(spline, constraints)
    if free:
        holds = "the supports and the cyclic symmetry leave" if cyclic else "the supports leave"
        what = f"{holds} {free} of 6 rigid motions free, so the loads are not balanced;"
        raise InputError(f"{what} fix more patches or components")
    diagonal = np.linalg.norm(np.ptp(spline.control, axis=0))
    metres = diagonal * METRES[length_unit]
    unit = replace(spline, control=spline.control / diagonal)
    solid, young, density = material.scaled()
    stiffness, _ = assemble_lower(Elements.of(unit), solid, n_gauss)
    faces = [faces_of(spline, load.place) for load in loads]
    cut = Cut.of(spline, preloads, supports, sector)
    spline = cut.spline
    elasticity = Elasticity.of(replace(spline, control=unit.control), solid, n_gauss)
    points = spline.extraction @ spline.control
    # the same solid with one function for each Bezier node
    nodal = replace(spline, control=points, extraction=eye(len(points), format="csr"))
    metre = METRES[length_unit]
    pull = np.zeros_like(points) + acceleration
    if rotation is not None:
        pull += metre * rotation.acceleration(points)
    on_nodes = density * metres**3 * elasticity.inertia(pull)
    for load, own in zip(loads, faces, strict=True):
        here = trace(nodal, own)
        push = load.traction_at(here.points, here.normals, here.area, metre)
        on_nodes += here.moments(push) * metre**2
    # pressure of a solid that cannot expand
    thermal = material.at().thermal
    heat = recovery.field_of(spline, points, lambda x: thermal * at_points(temperature, x))
    swelling = elasticity.expansion(heat / young)
    # for displacements in diagonals
    scaled = on_nodes / (young * metres**2) + swelling
    basis, offset = constraints.basis, constraints.offset / diagonal
    near = approximate_inverse(unit, constraints, solid)
    solve, rough = solvers(stiffness, constraints, constraints.points(spline.control), near)

    def coarse(rest: np.ndarray) -> np.ndarray:
        forces = basis.T @ (spline.extraction.T @ rest).ravel()
        return spline.extraction @ (basis @ rough(forces)).reshape(-1, 3)

    # under the loads, then for a unit of tightening of each preload
    pushes = [scaled, *(-elasticity.forces(jump) for jump in cut.jumps)]
    forces = np.stack([(spline.extraction.T @ push).ravel() for push in pushes])
    u = np.stack([offset, *np.zeros((len(cut.jumps), len(offset)))])
    for one, push in zip(u, forces, strict=True):
        one += basis @ solve(basis.T @ (push - stiffness @ one))
    fields = [spline.extraction @ one.reshape(-1, 3) for one in u]
    fields[1:] = [own + jump for own, jump in zip(fields[1:], cut.jumps, strict=True)]
    newtons = young * metres**2
    amounts = cut.tightening(elasticity, fields, scaled, newtons)
    residual = (stiffness @ (amounts @ u) - amounts @ forces) * newtons
    logger.info("%d unknowns of %d", basis.shape[1], basis.shape[0])
    enrichment = Enrichment.of(unit, elasticity, supports, coarse, sector, cut.copies)
    acting = [scaled, *np.zeros_like(cut.jumps)]
    fields = [corrected(enrichment, *each) for each in zip(acting, fields, strict=True)]
    amounts = cut.tightening(elasticity, fields, scaled, newtons)
    radius = away * diagonal
    displacement = np.tensordot(amounts, fields, axes=1) * diagonal
    singular = singular_places(spline, supports, faces, radius, sector, material.young)
    volume = elasticity.volume * metres**3
    stresses = _stresses(spline, material, displacement, heat, volume, singular, radius)
    # what a layer on the boundary adds to twice the energy, see `shape`
    push = 2 * metre * (displacement * pull).sum(axis=1)
    gain = recovery.field_of(spline, np.column_stack([stresses["stress"], push]), material.gain)
    energy = max(2 * stresses["strain_energy"], recovery.TINY)
    apart = float(distance_error(spline, gain)) * metre**3 / energy
    most = np.linalg.norm(recovery.samples(spline, displacement), axis=2).max()
    forced = cut.resultants(nodal, stresses["stress"] * metre**2)
    size = unit.extraction.shape[0]  # without the nodes in front of sections
    for name in ("stress", "von_mises"):
        stresses[name] = stresses[name][:size]
    return Deformation(
        displacement=displacement[:size],
        sections=np.stack([[p.force for p in preloads], forced, amounts[1:] * diagonal], axis=1),
        supports=tuple(support.name for support in supports),
        reactions=constraints.reactions(residual),
        load=on_nodes.sum(axis=0),
        mass=float((material.at().density * volume).sum()),
        units={"length": length_unit, "stress": "Pa", "force": "N", "energy": "J", "mass": "kg"},
        displacement_error=(recovery.SAFETY * stresses["stress_error"] ** 2 + apart) * float(most),
        **stresses,
    )


def _stresses(
    spline: Spline,
    material: Material,
    displacement: np.ndarray,
    heat: np.ndarray,
    volume: np.ndarray,
    singular: Sequence[Singular],
    radius: float,
) -> dict[str, Any]:
    """The stresses, their error and the energy of a Deformation.

    displacement : (B, 3)
    heat : (B,) thermal pressure, in Pa
    volume : (E, q) of the Gauss points, in m^3
    """

    def equivalent_of(slope: np.ndarray, elements: np.ndarray) -> np.ndarray:
        return von_mises(material.stress(slope, elements))[..., None]

    poor = poor_elements(spline)
    solution, thermal = (spline, displacement, material.stress), heat[:, None] * EQUAL
    stress = recovery.gradient_field(*solution, poor) - thermal
    equivalent = recovery.field_of(spline, stress, von_mises)
    largest = peaks(spline, displacement, equivalent, equivalent_of, poor, singular, radius)
    line = gauss(round(np.cbrt(volume.shape[1])))[0]
    raw = recovery.at_places(*solution, line) - volume_basis(line)[0] @ thermal[spline.nodes]
    error, energy = recovery.energy_error(spline.nodes, raw, stress, volume, material.work)
    return {
        "stress": stress,
        "von_mises": equivalent,
        "peak": largest[0],
        "singular": largest[1],
        "poor": int(poor.sum()),
        "stress_error": error,
        "strain_energy": energy / 2,
    }


def von_mises(stress: np.ndarray) -> np.ndarray:
    """(...) equivalent stress of stresses (..., 6) xx yy zz yz zx xy."""
    direct, shear = stress[..., :3], stress[..., 3:]
    differences = direct - np.roll(direct, 1, axis=-1)
    return np.sqrt((differences**2).sum(axis=-1) / 2 + 3 * (shear**2).sum(axis=-1))
