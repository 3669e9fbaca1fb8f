"""Charts of a labelled surface, the creases inside them, and their common coordinates.

A chart is a connected part with one label. All points of a chart with label +x or -x have one value
of x, and so have all points of a crease across x inside another chart; charts and creases with a
common vertex have the same value.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix, csc_matrix, csr_matrix, identity
from scipy.sparse.linalg import SuperLU, splu

from polycube.surface.measures import area_vectors, connected, face_normals, half_edges, twins
from polycube.types import TriMesh

from .pieces import Pieces

CREASE = np.cos(np.radians(8))  # largest cosine of two normals at a crease
# largest component of the direction of a crease along the axis in which it is constant
ACROSS = 0.4
PULL = 1e-7  # weight of the position itself, which determines the constant


@dataclass(frozen=True, eq=False)
class Charts:
    """Charts of a surface, and for each axis the groups of vertices with a common value."""

    label: np.ndarray  # (F,) 0..5
    chart: np.ndarray  # (F,) from 0
    part: np.ndarray  # (F,) part of a chart, in one face of the part, that contains each triangle
    chart_of_part: np.ndarray
    chart_label: np.ndarray  # (C,)
    group: np.ndarray  # (3, V) group of each vertex, or -1
    chart_group: np.ndarray  # (C,) group of each chart, along its own axis
    number: list[int]  # number of groups along each axis


def charts(pieces: Pieces, label: np.ndarray, with_creases: bool) -> Charts:
    """Charts of labels (P,) of pieces."""
    faces = pieces.surface.faces
    label = label[pieces.piece]
    first, second = twins(faces)
    same = label[first // 3] == label[second // 3]
    chart = connected(first[same] // 3, second[same] // 3, len(faces))
    chart_label = np.zeros(chart.max() + 1, int)
    chart_label[chart] = label
    n_vertices = len(pieces.surface.vertices)
    creases = _creases(pieces, label, first[same], second[same]) if with_creases else None
    group = np.full((3, n_vertices), -1)
    chart_group = np.zeros(len(chart_label), int)
    numbers = []
    for axis in range(3):
        on = label // 2 == axis
        vertex, owner = faces[on].ravel(), np.repeat(chart[on], 3)
        links = np.empty((0, 2), int) if creases is None else creases[axis]
        ends = np.append(n_vertices + owner, links[:, 1])
        component = connected(np.append(vertex, links[:, 0]), ends, n_vertices + len(chart_label))
        inside = np.append(vertex, links.ravel())
        used = np.unique(component[inside])
        group[axis, inside] = np.searchsorted(used, component[inside])
        chart_group[owner] = np.searchsorted(used, component[n_vertices + owner])
        numbers.append(len(used))
    both = np.stack([chart, pieces.face[pieces.piece]])
    named, part = np.unique(both, axis=1, return_inverse=True)
    return Charts(label, chart, part.ravel(), named[0], chart_label, group, chart_group, numbers)


def _creases(
    pieces: Pieces, label: np.ndarray, first: np.ndarray, second: np.ndarray
) -> list[np.ndarray]:
    """For each axis the edges (N, 2) inside charts between faces of the part that run across it.

    first, second : half-edges of the edges inside charts
    """
    face = pieces.face[pieces.piece]
    normals = face_normals(pieces.surface)
    cosine = np.einsum("ed,ed->e", normals[first // 3], normals[second // 3])
    first = first[(face[first // 3] != face[second // 3]) & (cosine < CREASE)]
    ends = half_edges(pieces.surface.faces)[first]
    own = label[first // 3] // 2
    direction = np.diff(pieces.surface.vertices[ends], axis=1)[:, 0]
    direction = np.abs(direction) / np.linalg.norm(direction, axis=1, keepdims=True)
    direction[np.arange(len(own)), own] = np.inf
    axis = direction.argmin(axis=1)
    crossing = direction[np.arange(len(own)), axis] < ACROSS
    return [ends[(axis == a) & crossing] for a in range(3)]


def chart_ends(pieces: Pieces, charts: Charts) -> tuple[np.ndarray, np.ndarray]:
    """Half-edges (E,) on borders of charts and on inner creases, and the opposite ones (E,)."""
    first, second = twins(pieces.surface.faces)
    face = pieces.face[pieces.piece]
    border = charts.chart[first // 3] != charts.chart[second // 3]
    border |= face[first // 3] != face[second // 3]
    return np.append(first[border], second[border]), np.append(second[border], first[border])


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
