"""-div k grad u = f with u or the flux given on the boundary, such as heat conduction."""

import logging
from collections.abc import Sequence

import numpy as np

from polycube.analysis import recovery
from polycube.analysis.assembly import Elements, Value, assemble_scalar_lower
from polycube.analysis.boundary_sets import faces_of, trace
from polycube.analysis.constraints import Support, constrain
from polycube.analysis.cyclic import Sector
from polycube.analysis.preconditioner import approximate_inverse, solvers
from polycube.analysis.problem import Cyclic, Flow
from polycube.analysis.shape import distance_error
from polycube.errors import InputError
from polycube.spline.bernstein import gauss
from polycube.spline.bezier import bezier_points
from polycube.types import Potential, Spline
from polycube.units import METRES

logger = logging.getLogger(__name__)


def conduct(
    spline: Spline,
    conductivity: Value,
    supports: Sequence[Support],
    flows: Sequence[Flow] = (),
    source: float | np.ndarray = 0.0,
    length_unit: str = "mm",
    n_gauss: int = 4,
    cyclic: Cyclic | None = None,
) -> Potential:
    """The solution: u in K, flux in W/m^2, lengths in the unit of the part.

    Raises InputError if u is not given anywhere, and MeshingError if det J <= 0.

    conductivity : W/(m K), a number or (E,) of the elements
    source : W/m^3, or its coefficients (C,)
    cyclic : the part is a sector, and each sector has the same temperatures
    """
    if not supports:
        what = "u is determined only up to a constant; prescribe it on at least one patch"
        raise InputError(what)
    metre = METRES[length_unit]
    sector = None if cyclic is None else Sector.of(spline, cyclic)
    constraints = constrain(spline, supports, 1, sector)
    inner = conductivity * metre
    stiffness, mass = assemble_scalar_lower(Elements.of(spline), n_gauss, inner)
    supplied = metre**3 * (mass @ np.broadcast_to(source, mass.shape[:1]))
    for flow in flows:
        here = trace(spline, faces_of(spline, flow.place))
        given = flow.flux(here.points, here.normals) if callable(flow.flux) else flow.flux
        supplied = supplied + metre**2 * here.moments(np.broadcast_to(given, here.area.shape))
    basis, offset = constraints.basis, constraints.offset
    near = approximate_inverse(spline, constraints, inner)
    solve, _ = solvers(stiffness, constraints, constraints.points(spline.control), near)
    u = basis @ solve(basis.T @ (supplied - stiffness @ offset)) + offset
    logger.info("%d unknowns of %d", basis.shape[1], basis.shape[0])
    nodal = spline.extraction @ u
    each = np.broadcast_to(conductivity, len(spline.nodes))[:, None]
    solution = spline, nodal, lambda u, own: -each[own, None] / metre * u[..., 0, :]
    flux = recovery.gradient_field(*solution)
    raw = recovery.at_places(*solution, gauss(n_gauss)[0])
    given = spline.nodes, raw, flux, recovery.volumes(bezier_points(spline), n_gauss)
    error, energy = recovery.energy_error(*given, lambda q: (q**2).sum(axis=-1) / each)
    # what a layer on the boundary adds to the energy, see `shape`; u above its smallest value
    heat = spline.extraction @ np.broadcast_to(source, mass.shape[:1])
    fields = np.column_stack([2 * heat, nodal - nodal.min(), flux])
    gain = recovery.field_of(
        spline, fields, lambda x: x[..., 0] * x[..., 1] - (x[..., 2:] ** 2).sum(axis=-1) / each
    )
    apart = float(distance_error(spline, gain)) / max(energy, recovery.TINY)
    return Potential(
        values=u,
        flux=flux,
        flux_error=error,
        u_error=(recovery.SAFETY * error**2 + apart) * float(np.ptp(nodal)),
        supports=tuple(support.name for support in supports),
        flows=constraints.reactions(stiffness @ u - supplied)[:, 0],
        supplied=float(supplied.sum()),
        units={"length": length_unit, "u": "K", "flux": "W/m^2", "flow": "W"},
    )
