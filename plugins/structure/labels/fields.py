"""Polycube coordinates of a surface: three Poisson problems with one unknown per group.

The coordinate f along an axis has a gradient as close as possible to that of the position x,

    integral |grad f - grad x|^2 -> min,

with one value of f on each group of vertices.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix, csc_matrix, csr_matrix, identity
from scipy.sparse.linalg import SuperLU, splu

from polycube.surface.measures import area_vectors
from polycube.types import TriMesh

PULL = 1e-7  # weight of the position itself, which determines the constant


def stiffness(surface: TriMesh) -> csr_matrix:
    """(V, V) of linear elements: f' L f is the integral of |grad f|^2."""
    faces = surface.faces
    corners = surface.vertices[faces]
    opposite = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]  # edge opposite to each corner
    double = np.maximum(2 * np.linalg.norm(area_vectors(surface), axis=1), 1e-12)
    local = np.einsum("fid,fjd->fij", opposite, opposite) / (2 * double)[:, None, None]
    rows, columns = np.repeat(faces, 3, axis=1).ravel(), np.tile(faces, (1, 3)).ravel()
    size = len(surface.vertices)
    return coo_matrix((local.ravel(), (rows, columns)), shape=(size, size)).tocsr()


@dataclass(frozen=True, eq=False)
class Field:
    """A Poisson problem along one axis after eliminating the vertices outside the groups."""

    group: np.ndarray  # (V,) or -1
    free: np.ndarray  # (N,) vertices outside the groups
    solver: SuperLU
    coupling: csc_matrix  # (N, G)
    right: np.ndarray  # (N,)
    form: np.ndarray  # (G, G) the energy of the values c of the groups is c' form c - 2 load . c
    load: np.ndarray  # (G,)

    def values(self, constants: np.ndarray) -> np.ndarray:
        """(V,) coordinate for values (G,) of the groups."""
        found = constants[np.maximum(self.group, 0)]
        found[self.free] = self.solver.solve(self.right - self.coupling @ constants)
        return found

    @property
    def constants(self) -> np.ndarray:
        """(G,) values of minimum energy."""
        return np.linalg.solve(self.form, self.load)


def field(matrix: csr_matrix, place: np.ndarray, group: np.ndarray, number: int) -> Field:
    """The problem for a coordinate of the vertices (V,) and their groups (V,)."""
    n = len(place)
    free = np.flatnonzero(group < 0)
    grouped = np.flatnonzero(group >= 0)
    energy = matrix + PULL * identity(n)
    right = energy @ place
    share = csr_matrix((np.ones(len(grouped)), (grouped, group[grouped])), shape=(n, number))
    inner = energy[free][:, free].tocsc()
    coupling = (energy[free] @ share).tocsc()
    solver = splu(inner, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    inverse = solver.solve(np.column_stack([coupling.toarray(), right[free]]))
    form = (share.T @ energy @ share).toarray() - coupling.T @ inverse[:, :-1]
    load = share.T @ right - coupling.T @ inverse[:, -1]
    return Field(group, free, solver, coupling, right[free], (form + form.T) / 2, load)
