"""Boundary faces of a spline or of its mesh, given by name, patch number, box or plane,
and integrals over them.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix, diags

from polycube.errors import InputError
from polycube.hexmesh.face_groups import LEVEL
from polycube.hexmesh.named_sets import (
    Sets,
    boundary_sets,
    listed,
    may_name,
    set_name,
    sets_of_quads,
)
from polycube.spline.bernstein import gauss
from polycube.spline.boundary import corner_nodes, grid, sampling
from polycube.types import HexMesh, Spline

N_GAUSS = 5  # per direction: exact for bicubic traces times normals


def faces_of(spline: Spline, where: object) -> np.ndarray:
    """(F,) indices in `spline.sides` of the faces at a place.

    where : patch number, name of a set, {"box": [x, y, z, x, y, z]} for the faces with all corners
        in the box, or {"plane": [a, b, c, d]} for those with all corners on a x + b y + c z = d

    Raises InputError with the names of the existing sets.
    """
    if isinstance(where, Mapping):
        return _within((spline.extraction @ spline.control)[corner_nodes(spline)], where)
    return _named(spline.sets or sets_of_sides(spline), where)


def quads_of(mesh: HexMesh, where: object) -> np.ndarray:
    """(F,) indices in `mesh.quads` of the faces at a place, as for `faces_of`."""
    if isinstance(where, Mapping):
        return _within(mesh.vertices[mesh.quads], where)
    return _named(mesh.sets or boundary_sets(mesh), where)


def sets_of_sides(spline: Spline) -> dict[str, np.ndarray]:
    """The sets of the boundary of a spline alone, with its faces as quads."""
    corners = corner_nodes(spline)
    return sets_of_quads(spline.extraction @ spline.control, corners, spline.patch)


def check_names(places: Iterable[object], sets: Sets) -> None:
    """Raise InputError for the first name or number without a set; accept boxes and planes."""
    for where in places:
        if not isinstance(where, Mapping) and not len(sets.get(set_name(where), ())):
            raise InputError(
                f"no boundary set {where!r}; there are {listed(sets)}; {{box: ...}} and "
                "{plane: ...} choose faces by their place"
            )


def check_place(where: object) -> None:
    """Raise ValueError unless `where` has a form that `faces_of` accepts."""
    lengths = {"box": 6, "plane": 4}
    if isinstance(where, Mapping):
        good = len(where) == 1 and all(
            lengths.get(key) == len(np.atleast_1d(value)) for key, value in where.items()
        )
    else:
        good = isinstance(where, int | str) and not isinstance(where, bool) and may_name(where)
    if not good:
        raise ValueError(
            "boundary faces are a patch number, a name (x_min to z_max, hole_1, cad_face_1 ...), "
            f"{{box: [x, y, z, x, y, z]}} or {{plane: [a, b, c, d]}}; got {where!r}"
        )


def place_of(item: object) -> object:
    """The place of an entry of a list of supports or loads: `at`, or the entry itself."""
    return item["at"] if isinstance(item, Mapping) and "at" in item else item


def place_name(where: object) -> str:
    """The place as one word, for tables."""
    if not isinstance(where, Mapping):
        return str(where)
    [(kind, numbers)] = where.items()
    return f"{kind} {' '.join(f'{number:g}' for number in numbers)}"


def _named(sets: Sets, name: object) -> np.ndarray:
    check_names([name], sets)
    return np.asarray(sets[set_name(name)])


def _within(corners: np.ndarray, where: Mapping[str, object]) -> np.ndarray:
    """(F,) faces, of those with corners (Q, 4, 3), in a box or on a plane."""
    [(kind, numbers)] = where.items()
    numbers = np.asarray(numbers, dtype=np.float64)
    slack = LEVEL * np.linalg.norm(np.ptp(corners, axis=(0, 1)))
    if kind == "plane":
        off = np.abs(corners @ numbers[:3] - numbers[3]) / np.linalg.norm(numbers[:3])
        inside = off <= slack
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
    """Values of the spline functions at Gauss points on some boundary faces."""

    shape: csr_matrix  # (P, C)
    points: np.ndarray  # (P, 3)
    normals: np.ndarray  # (P, 3) outward, length 1
    area: np.ndarray  # (P,) area of each point

    @property
    def gram(self) -> csr_matrix:
        """(C, C) integrals of N_a N_b."""
        return csr_matrix(self.shape.T @ diags(self.area) @ self.shape)

    def moments(self, density: np.ndarray) -> np.ndarray:
        """(C,) or (C, n) integrals of N_a times a density (P,) or (P, n) at the points."""
        density = np.asarray(density)
        area = self.area.reshape(-1, *[1] * (density.ndim - 1))
        return self.shape.T @ (area * density)


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
