"""Values prescribed on boundary faces and edges, imposed exactly.

A function is bound by its trace there. If the traces of the bound functions are linearly
independent, all their coefficients follow from the prescribed values (least squares in L2 of the
faces, exact for values in the space). If not, as in a space with functions centred outside the
solid, a subset that spans the traces is chosen, `pivots`, and the others stay free: c_pivots =
c_given - X c_others. Then u = basis @ free + offset has the prescribed trace for any `free`.
"""

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix, diags, eye, kron, spmatrix, vstack
from scipy.sparse.linalg import SuperLU, splu

from polycube.analysis.boundary_sets import Trace, edge_trace, trace, zero_slope_edges
from polycube.analysis.cyclic import Sector
from polycube.errors import InputError
from polycube.numerics.independent import independent
from polycube.spline.boundary import N_GAUSS, boundary_nodes
from polycube.types import Spline

logger = logging.getLogger(__name__)

ABSENT = 1e-18  # of the largest squared norm of a trace: smaller traces count as zero
RIGID = 1e-10  # of the largest eigenvalue: below it, a rigid motion is free

Value = float | Sequence[float] | Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class Support:
    """Prescribed values of some components on boundary faces and edges.

    value : constant values, or a function of points (P, 3), with one column per component
    """

    name: str
    faces: np.ndarray  # (F,) indices of spline.sides
    components: tuple[int, ...] = (0, 1, 2)
    value: Value = 0.0
    # (N, 4) Bezier nodes of edges
    edges: np.ndarray = field(default_factory=lambda: np.zeros((0, 4), np.int64))

    def nodes(self, spline: Spline) -> np.ndarray:
        """Bezier nodes with prescribed values, with repetitions."""
        return np.append(boundary_nodes(spline)[self.faces], self.edges)

    def at(self, points: np.ndarray) -> np.ndarray:
        """(P, components) values at points (P, 3)."""
        value = self.value(points) if callable(self.value) else self.value
        value = np.asarray(value, dtype=np.float64)
        value = value[:, None] if callable(self.value) and value.ndim == 1 else value
        return np.broadcast_to(value, (len(points), len(self.components)))


@dataclass(frozen=True, eq=False)
class BoundTrace:
    """Constraints of one component: dependent coefficients and their dependence."""

    trace: Trace
    owner: np.ndarray  # (P,) number of the support of each Gauss point
    pivots: np.ndarray  # (R,) functions
    imposed: csr_matrix  # (C, C) leaves the other coefficients and computes those of the pivots
    gram: SuperLU  # Gram matrix of the traces of the pivots


@dataclass(frozen=True, eq=False)
class Constraints:
    """Constraints of all components; coefficient i of function a is number n a + i."""

    supports: tuple[Support, ...]
    bound: tuple[BoundTrace | None, ...]  # one for each component
    basis: csr_matrix  # (n C, free)
    offset: np.ndarray  # (n C,)
    sector: Sector | None = None  # of a whole with cyclic symmetry

    def points(self, places: np.ndarray) -> np.ndarray:
        """(free, 3) approximate position of each free coefficient; places (C, 3) of functions."""
        weight = abs(self.basis).T
        near = weight @ np.repeat(places, len(self.bound), axis=0)
        return near / np.asarray(weight.sum(axis=1))

    def restricted(self, matrix: spmatrix) -> csr_matrix:
        """(free, free) part of a matrix (n C, n C)."""
        return csr_matrix(self.basis.T @ matrix @ self.basis)

    def reactions(self, residual: np.ndarray) -> np.ndarray:
        """(supports, n) resultant on each support for a residual (n C,), K u - f.

        That is the integral over its faces of the traction which the residual gives.
        """
        n = len(self.bound)
        if self.sector is not None:  # leave out the forces between the sectors
            same = self.sector.basis(np.ones((len(residual) // n, n), bool), self.sector.functions)
            residual = same @ (same.T @ residual)
        found = np.zeros((len(self.supports), n))
        for i, bound in enumerate(self.bound):
            if bound is None:
                continue
            traction = bound.gram.solve(residual[i::n][bound.pivots])
            for k in range(len(found)):
                found[k, i] = traction @ bound.trace.moments(bound.owner == k)[bound.pivots]
        return found


def constrain(
    spline: Spline, supports: Sequence[Support], n_components: int, sector: Sector | None = None
) -> Constraints:
    """The space of fields with the prescribed values and the symmetry of a sector.

    The last support of a face has precedence. Raises InputError if values are not symmetric.
    """
    size = len(spline.control)
    bound: list[BoundTrace | None] = []
    imposed: list[csr_matrix] = []
    known: dict[bytes, BoundTrace] = {}  # by the owner of each face
    offset = np.zeros((size, n_components))
    for i in range(n_components):
        owner = np.full(len(spline.sides), -1)
        edges = {k: s.edges for k, s in enumerate(supports) if i in s.components and len(s.edges)}
        for k, support in enumerate(supports):
            if i in support.components:
                owner[support.faces] = k
        if (owner < 0).all() and not edges:
            bound.append(None)
            imposed.append(eye(size, format="csr"))
            continue
        key = owner.tobytes() + str(list(edges)).encode()
        if key not in known:
            known[key] = _bind(spline, owner, edges)
            flat, border = zero_slope_edges(spline, np.flatnonzero(owner >= 0), known[key].imposed)
            if flat:
                what = f"the spline is smooth at {flat} of the {border} edges round the supports"
                remedy = "a run with from=spline makes them sharp if det J allows it"
                logger.warning("warning: %s, so the result is too stiff; %s", what, remedy)
        bound.append(known[key])
        imposed.append(known[key].imposed)
        offset[:, i] = _prescribed_coefficients(known[key], supports, i, size)
    places = np.eye(n_components)
    every = sum(kron(own, diags(place), "csr") for own, place in zip(imposed, places, strict=True))
    basis = csr_matrix(every[:, every.diagonal() != 0])
    if sector is not None:
        sector.check(offset)
        if basis.nnz > basis.shape[1]:
            raise InputError("cyclic symmetry needs a spline that is clamped at the supports")
        basis = sector.basis(np.diff(basis.indptr).reshape(offset.shape) > 0, sector.functions)
    return Constraints(tuple(supports), tuple(bound), basis, offset.ravel(), sector)


def free_rigid_motions(spline: Spline, constraints: Constraints) -> int:
    """Number of the six rigid motions of an elastic solid that the constraints leave free."""
    middle = spline.control.mean(axis=0)
    size = np.linalg.norm(np.ptp(spline.control, axis=0))
    energy = np.zeros((6, 6))

    def motions(points: np.ndarray) -> np.ndarray:
        """(P, 3, 6) displacements at points (P, 3)."""
        turns = [np.cross(axis, (points - middle) / size) for axis in np.eye(3)]
        moves = np.broadcast_to(np.eye(3), (len(points), 3, 3))
        return np.concatenate([moves, np.stack(turns, axis=2)], axis=2)

    for i, bound in enumerate(constraints.bound):
        if bound is not None:
            motion = motions(bound.trace.points)[:, i]
            energy += motion.T @ (motion * bound.trace.area[:, None]) / bound.trace.area.sum()
    if constraints.sector is not None:
        cyclic, at = constraints.sector.cyclic, spline.control
        off = (motions(cyclic.turned(at)) - cyclic.turn @ motions(at)).reshape(-1, 6)
        energy += off.T @ off / len(at)
    values = np.linalg.eigvalsh(energy)
    return int((values <= RIGID * max(values[-1], np.finfo(float).tiny)).sum())


def _prescribed_coefficients(
    bound: BoundTrace, supports: Sequence[Support], i: int, size: int
) -> np.ndarray:
    """(C,) coefficients with the trace closest to the prescribed values of component i."""
    values, found = np.zeros(len(bound.owner)), np.zeros(size)
    for k, support in enumerate(supports):
        if i in support.components:
            here = bound.owner == k
            values[here] = support.at(bound.trace.points[here])[:, support.components.index(i)]
    if values.any():
        found[bound.pivots] = bound.gram.solve(bound.trace.moments(values)[bound.pivots])
    return found


def _bind(spline: Spline, owner: np.ndarray, edges: Mapping[int, np.ndarray]) -> BoundTrace:
    """Bind the functions on the faces with an owner (Q,), and on the edges (N, 4) of supports."""
    faces = np.flatnonzero(owner >= 0)
    parts = [trace(spline, faces), *(edge_trace(spline, each) for each in edges.values())]
    owners = [np.repeat(owner[faces], N_GAUSS**2)]
    owners += [np.full(N_GAUSS * len(each), k) for k, each in edges.items()]
    shape = csr_matrix(vstack([part.shape for part in parts]))
    rest = ([part.points, part.normals, part.area] for part in parts)
    here = Trace(shape, *map(np.concatenate, zip(*rest, strict=True)))
    gram = csr_matrix(here.shape.T @ diags(here.area) @ here.shape)
    norm = gram.diagonal()
    bound = np.flatnonzero(norm > ABSENT * norm.max())
    small = csc_matrix(gram[bound][:, bound])
    is_pivot = independent(small)
    pivots, others = np.flatnonzero(is_pivot), np.flatnonzero(~is_pivot)
    factor = splu(small[pivots][:, pivots])
    ratio = factor.solve(small[pivots][:, others].toarray())  # X
    row, column = np.nonzero(np.abs(ratio) >= 1e-12)
    place = bound[pivots[row]], bound[others[column]]
    is_free = np.ones(len(norm))
    is_free[bound[pivots]] = 0
    imposed = diags(is_free) - csr_matrix((ratio[row, column], place), gram.shape)
    return BoundTrace(here, np.concatenate(owners), bound[pivots], csr_matrix(imposed), factor)
