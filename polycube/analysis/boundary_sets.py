"""Boundary faces and edges of a spline or of its mesh, given by name, patch number, box or plane,
and integrals over them.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeGuard

import numpy as np
from scipy.sparse import csr_matrix

from polycube.errors import InputError
from polycube.hexmesh import named_sets
from polycube.hexmesh.connectivity import quad_edges
from polycube.hexmesh.face_groups import LEVEL
from polycube.spline.bernstein import bernstein, derivative, gauss
from polycube.spline.boundary import N_GAUSS, corner_nodes, edge_strips, grid, sampling
from polycube.types import HexMesh, Spline

FLAT = 1e-12  # coefficients of the slope at an edge that count as zero


def faces_of(spline: Spline, where: object) -> np.ndarray:
    """(F,) indices in `spline.sides` of the faces at a place.

    where : patch number, name of a set, {"box": [x, y, z, x, y, z]} for the faces with all corners
        in the box, or {"plane": [a, b, c, d]} for those with all corners on a x + b y + c z = d;
        or the indices themselves

    Raises InputError with the names of the existing sets.
    """
    if isinstance(where, np.ndarray):
        return where
    if isinstance(where, Mapping):
        return _within((spline.extraction @ spline.control)[corner_nodes(spline)], where)
    return _named(spline.sets or sets_of_sides(spline), where)


def quads_of(mesh: HexMesh, where: object) -> np.ndarray:
    """(F,) indices in `mesh.quads` of the faces at a place, as for `faces_of`.

    Those of an edge are the faces on both sides.
    """
    if is_edge(where):
        return np.unique(mesh_edges_of(mesh, where)[1])
    if isinstance(where, Mapping):
        return _within(mesh.vertices[mesh.quads], where)
    return _named(mesh.sets or named_sets.boundary_sets(mesh), where)


def is_edge(where: object) -> TypeGuard[Mapping[str, Any]]:
    """Whether a place is the edge between two sets, {"edge": [name, name]}."""
    return isinstance(where, Mapping) and "edge" in where


def edges_of(spline: Spline, where: Mapping[str, Any]) -> np.ndarray:
    """(N, 4) Bezier nodes along the boundary edges between the two sets of an edge."""
    strips, first, second = edge_strips(spline)
    pairs = np.stack([first, second], axis=1) // 4
    return strips[first[_between(pairs, where, lambda name: faces_of(spline, name))], 0]


def mesh_edges_of(mesh: HexMesh, where: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Boundary edges (N, 2) between the two sets of an edge, and the quads (N, 2) beside them."""
    edges, sides = quad_edges(mesh.quads)
    own = _between(sides, where, lambda name: quads_of(mesh, name))
    return edges[own], sides[own]


def _between(
    sides: np.ndarray, where: Mapping[str, Any], faces: Callable[[object], np.ndarray]
) -> np.ndarray:
    """(N,) whether an edge has one of its faces (N, 2) in each of two sets.

    Raises InputError if the sets have no common edge.
    """
    one, two = (np.isin(sides, faces(name)) for name in where["edge"])
    found = np.any(one & two[:, ::-1], axis=1)
    if not found.any():
        raise InputError(f"there is no {place_name(where)}: the two do not touch")
    return found


def sets_of_sides(spline: Spline) -> dict[str, np.ndarray]:
    """The sets of the boundary of a spline alone, with its faces as quads."""
    corners = corner_nodes(spline)
    return named_sets.sets_of_quads(spline.extraction @ spline.control, corners, spline.patch)


def names_in(places: Iterable[object]) -> list[object]:
    """The names and numbers of sets among places, without boxes and planes."""
    found = [name for place in places for name in (place["edge"] if is_edge(place) else [place])]
    return [name for name in found if not isinstance(name, Mapping)]


def check_names(places: Iterable[object], sets: named_sets.Sets) -> None:
    """Raise InputError for the first name or number without a set; accept boxes and planes."""
    for where in names_in(places):
        if not len(sets.get(named_sets.set_name(where), ())):
            raise InputError(
                f"no boundary set {where!r}; there are {named_sets.listed(sets)}; {{box: ...}} and "
                "{plane: ...} choose faces by their place"
            )


def check_place(where: object) -> None:
    """Raise ValueError unless `where` has a form that `faces_of` accepts."""
    lengths = {"box": 6, "plane": 4}
    if is_edge(where):
        ends = where["edge"]
        good = isinstance(ends, Sequence) and len(ends) == 2 and all(map(_may_name, ends))
    elif isinstance(where, Mapping):
        good = len(where) == 1 and all(
            lengths.get(key) == len(np.atleast_1d(value)) for key, value in where.items()
        )
    else:
        good = _may_name(where)
    if not good:
        raise ValueError(
            "boundary faces are a patch number, a name (x_min to z_max, hole_1, cad_face_1 ...), "
            f"{{box: [x, y, z, x, y, z]}} or {{plane: [a, b, c, d]}}, and an edge is "
            f"{{edge: [name, name]}}; got {where!r}"
        )


def _may_name(where: object) -> bool:
    return (
        isinstance(where, int | str) and not isinstance(where, bool) and named_sets.may_name(where)
    )


def place_name(where: object) -> str:
    """The place as one word, for tables."""
    if not isinstance(where, Mapping):
        return str(where)
    [(kind, numbers)] = where.items()
    if is_edge(where):
        return f"edge of {numbers[0]} and {numbers[1]}"
    return f"{kind} {' '.join(f'{number:g}' for number in numbers)}"


def _named(sets: named_sets.Sets, name: object) -> np.ndarray:
    check_names([name], sets)
    return np.asarray(sets[named_sets.set_name(name)])


def _within(corners: np.ndarray, where: Mapping[str, object]) -> np.ndarray:
    """(F,) faces, of those with corners (Q, 4, 3), in a box or on a plane."""
    [(kind, numbers)] = where.items()
    numbers = np.asarray(numbers, dtype=np.float64)
    slack = LEVEL * np.linalg.norm(np.ptp(corners, axis=(0, 1)))
    if kind == "plane":
        inside = np.abs(corners @ numbers[:3] - numbers[3]) / np.linalg.norm(numbers[:3]) <= slack
    else:
        inside = ((corners >= numbers[:3] - slack) & (corners <= numbers[3:] + slack)).all(axis=2)
    found = np.flatnonzero(inside.all(axis=1))
    if len(found) == 0:
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        raise InputError(
            f"no boundary face lies in {place_name(where)}; the part fills "
            f"{' '.join(f'{x:.4g}' for x in low)} to {' '.join(f'{x:.4g}' for x in high)}"
        )
    return found


@dataclass(frozen=True, eq=False)
class Trace:
    """Values of the spline functions at Gauss points on some boundary faces and edges."""

    shape: csr_matrix  # (P, C)
    points: np.ndarray  # (P, 3)
    normals: np.ndarray  # (P, 3) outward, length 1
    area: np.ndarray  # (P,) area of each point; on an edge, its length times that of the element

    def moments(self, density: np.ndarray) -> np.ndarray:
        """(C,) or (C, n) integrals of N_a times a density (P,) or (P, n) at the points."""
        density = np.asarray(density)
        return self.shape.T @ (self.area.reshape(-1, *[1] * (density.ndim - 1)) * density)


def trace(spline: Spline, faces: np.ndarray) -> Trace:
    """N_GAUSS^2 Gauss points on each of `spline.sides[faces]`."""
    t, w = gauss(N_GAUSS)
    u, v = (np.tile(each, len(faces)) for each in grid(t))
    at, du, dv = sampling(spline, u, v, np.repeat(faces, N_GAUSS**2))
    nodes = spline.extraction @ spline.control
    normal = np.cross(du @ nodes, dv @ nodes)
    length = np.linalg.norm(normal, axis=1)
    return Trace(
        shape=csr_matrix(at @ spline.extraction),
        points=at @ nodes,
        normals=normal / np.maximum(length, np.finfo(float).tiny)[:, None],
        area=length * np.tile(np.kron(w, w), len(faces)),
    )


def edge_trace(spline: Spline, edges: np.ndarray) -> Trace:
    """N_GAUSS Gauss points on each edge, given by its Bezier nodes (N, 4); normals are zero."""
    t, w = gauss(N_GAUSS)
    nodal = spline.extraction @ spline.control
    speed = np.linalg.norm(derivative(t) @ nodal[edges], axis=2)
    columns = np.repeat(edges, len(t), axis=0).ravel()
    size, ends = (len(edges) * len(t), len(nodal)), np.arange(0, len(columns) + 1, 4)
    at = csr_matrix((np.tile(bernstein(t), (len(edges), 1)).ravel(), columns, ends), size)
    area = (speed * w * (speed @ w)[:, None]).ravel()
    return Trace(csr_matrix(at @ spline.extraction), at @ nodal, np.zeros((size[0], 3)), area)


def zero_slope_edges(spline: Spline, faces: np.ndarray, basis: csr_matrix) -> tuple[int, int]:
    """Number of edges of constrained faces with zero slope on the other side, and of all edges.

    faces : (F,) indices of `spline.sides`
    basis : (C, free) functions that vanish there

    If the space is smooth at an edge, a function that vanishes on one side starts with zero slope
    on the other, which is an additional constraint. Edges between elements of different levels do
    not count.
    """
    strips, *meeting = edge_strips(spline)
    one, other = np.concatenate([meeting, meeting[::-1]], axis=1)
    is_constrained = np.isin(np.arange(len(spline.sides)), faces)
    second = strips[other[is_constrained[one // 4] & ~is_constrained[other // 4]], 1, 1:3]
    slope = np.asarray(abs(spline.extraction[second.ravel()] @ basis).sum(axis=1))
    is_flat = np.all(slope.reshape(-1, 2) <= FLAT, axis=1)
    return int(is_flat.sum()), len(is_flat)
