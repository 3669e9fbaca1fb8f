"""Halve a hex mesh in each direction: rules for control points, exact rules for Bezier elements.

The rules are those of MacCracken and Joy inside and of Catmull and Clark on the boundary; sharp
curves are cubic splines and corners are fixed: the refinement of TH-spline3D. Its finer functions
contain the coarser ones where the mesh is regular, but not around extraordinary edges.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix, diags, vstack

from polycube.hexmesh.connectivity import PLACES, edges, part, split
from polycube.spline.spaces.extraction import (
    CORNERS,
    NO_INDICES,
    TENSOR,
    OnHexes,
    bezier_nodes,
    extraction_matrix,
)
from polycube.spline.spaces.sharp_features import is_among
from polycube.types import HexMesh

LOW = np.array([[8, 0, 0, 0], [4, 4, 0, 0], [2, 4, 2, 0], [1, 3, 3, 1]]) / 8  # de Casteljau's
HALF = (LOW, LOW[::-1, ::-1])
CASTELJAU = np.stack([np.kron(np.kron(HALF[k], HALF[j]), HALF[i]) for i, j, k in PLACES])


def bezier_halves(
    nodes: np.ndarray, finer_nodes: np.ndarray, wanted: np.ndarray, n_nodes: int
) -> csr_matrix:
    """(W, n_nodes) rows that give Bezier nodes of children from those of their parents, exactly.

    nodes : (P, 64) of the parents
    finer_nodes : (8 P, 64) of their children in VTK corner order
    wanted : (W,) among these
    """
    order = np.argsort(finer_nodes.ravel(), kind="stable")
    first = order[np.searchsorted(finer_nodes.ravel(), wanted, sorter=order)]
    child, place = np.divmod(first, 64)
    weights = CASTELJAU[child % 8, place]  # (W, 64)
    indptr = np.arange(len(wanted) + 1) * 64
    rows = csr_matrix((weights.ravel(), nodes[child // 8].ravel(), indptr), (len(wanted), n_nodes))
    rows.eliminate_zeros()
    return rows


def two_scale(
    mesh: HexMesh,
    sharp_edges: np.ndarray,
    corner_vertices: np.ndarray = NO_INDICES,
    straight: np.ndarray = NO_INDICES,
) -> csr_matrix:
    """(V', V) control points of the mesh from `octree.split`, from those of the mesh.

    sharp_edges : (S, 2), corner_vertices and straight, as for `volumetric_spline`

    Faces with one hex follow the rules of the boundary.
    """
    corners = mesh.hexes[:, TENSOR]
    _, number = bezier_nodes(corners)
    touch = _Incidence(number)
    outside = touch.valence(2, 3) == 1
    on_edge, on_vertex = (touch.valence(d, 2, outside) > 0 for d in (1, 0))
    ends = np.sort(corners[:, CORNERS[1]], axis=-1)  # (H, 12, 2)
    sharp = np.zeros(number[1].max() + 1, bool)
    sharp[number[1][is_among(ends, np.sort(sharp_edges, axis=1))]] = True
    n_sharp = touch.valence(0, 1, sharp)
    tip = (n_sharp == 1) | (n_sharp > 2)
    tip[np.asarray(corner_vertices, np.int64)] = True
    tip[number[0][straight]] = True
    sharp[number[1][straight]] = True
    flat = outside.copy()
    flat[number[2][straight]] = True

    same, edge, face, body = (touch.centres(d) for d in range(4))
    faces = _choose((~flat, (touch.mean(2, 3) @ body + face) / 2), (flat, face))
    n = touch.valence(1, 3)
    inner = touch.mean(1, 3) @ body + 2 * touch.mean(1, 2) @ face + diags(n - 3.0) @ edge
    edges = _choose(
        (~on_edge & ~sharp, diags(1 / n) @ inner),
        (on_edge & ~sharp, (touch.mean(1, 2, outside) @ face + edge) / 2),
        (sharp, edge),
    )
    inner = touch.mean(0, 3) @ body + 3 * touch.mean(0, 2) @ face + 3 * touch.mean(0, 1) @ edge
    n = np.maximum(touch.valence(0, 2, outside), 1)
    outer = touch.mean(0, 2, outside) @ face + 2 * touch.mean(0, 1, on_edge) @ edge
    curve = (n_sharp == 2) & ~tip
    vertices = _choose(
        (~on_vertex & ~tip, (inner + same) / 8),
        (on_vertex & ~curve & ~tip, diags(1 / n) @ (outer + diags(n - 3.0) @ same)),
        (curve, (touch.mean(0, 1, sharp) @ edge + same) / 2),
        (tip, same),
    )
    return vstack([vertices, edges, faces, body], format="csr")


def _choose(*cases: tuple[np.ndarray, csr_matrix]) -> csr_matrix:
    """The rows of each case, selected by its mask."""
    return csr_matrix(sum(diags(mask.astype(np.float64)) @ rows for mask, rows in cases))


class _Incidence:
    """Adjacency of the entities of a hex mesh: dimension 0 vertices, 1 edges, 2 faces, 3 bodies."""

    def __init__(self, number: list[np.ndarray]) -> None:
        """number : [d] (H, n_d) number of each entity of each hex"""
        count = [int(local.max()) + 1 for local in number]
        self._matrix = {}
        for (d, e), (below, above) in _INSIDE.items():
            pair = number[d][:, below].ravel(), number[e][:, above].ravel()
            matrix = csr_matrix((np.ones(len(pair[0])), pair), (count[d], count[e]))
            matrix.data[:] = 1
            self._matrix[d, e] = matrix

    def valence(self, d: int, e: int, chosen: np.ndarray | None = None) -> np.ndarray:
        """(n_d,) number of entities of dimension e, or of chosen ones (n_e,), adjacent to each."""
        matrix = self._matrix[d, e]
        chosen = np.ones(matrix.shape[1]) if chosen is None else chosen
        return (matrix @ chosen).astype(np.int64)

    def mean(self, d: int, e: int, chosen: np.ndarray | None = None) -> csr_matrix:
        """(n_d, n_e) mean over the adjacent entities of dimension e, or over chosen ones."""
        matrix = self._matrix[d, e]
        matrix = matrix if chosen is None else matrix @ diags(chosen.astype(np.float64))
        return diags(1 / np.maximum(self.valence(d, e, chosen), 1)) @ matrix

    def centres(self, d: int) -> csr_matrix:
        """(n_d, n_0) mean of the corners of each entity."""
        return self._matrix[0, d].T.tocsr() / 2**d


def _pairs(d: int, e: int) -> np.ndarray:
    """(2, P) local numbers of pairs of entities of dimensions d and e, one within the other."""
    small, large = ([set(row) for row in CORNERS[k].tolist()] for k in (d, e))
    return np.transpose(
        [(i, j) for i, a in enumerate(small) for j, b in enumerate(large) if a <= b]
    )


_INSIDE = {(d, e): _pairs(d, e) for e in range(4) for d in range(e + 1)}


@dataclass(frozen=True, eq=False)
class ControlMesh(OnHexes):
    """The h2s space of a hex mesh with its sharp features; implements `hierarchy.Space`."""

    sharp_edges: np.ndarray  # (S, 2)
    corner_vertices: np.ndarray  # (P,)
    straight: np.ndarray = field(default_factory=lambda: NO_INDICES)  # (T,) trilinear hexes

    @cached_property
    def _rows(self) -> tuple[csr_matrix, np.ndarray]:
        return extraction_matrix(self.mesh, self.sharp_edges, self.corner_vertices, self.straight)

    @property
    def control(self) -> np.ndarray:
        """(C, 3) control points, the vertices."""
        return self.mesh.vertices

    @property
    def extraction(self) -> csr_matrix:
        """(B, C) rows of all Bezier nodes."""
        return self._rows[0]

    @property
    def nodes(self) -> np.ndarray:
        """(E, 64) Bezier nodes of each hex."""
        return self._rows[1]

    def finer(self, elements: np.ndarray) -> tuple[ControlMesh, csr_matrix]:
        """Divide hexes into eight, hex i into 8 i to 8 i + 7; two-scale matrix (V', V).

        At the rim of the elements, the mesh ends as at its boundary.
        """
        piece, used = self._part(elements)
        halving = two_scale(piece.mesh, piece.sharp_edges, piece.corner_vertices, piece.straight)
        control = halving @ piece.mesh.vertices
        ends = np.sort(piece.sharp_edges, axis=1)
        finer = replace(split(piece.mesh), vertices=control)
        middles = len(used) + _places(edges(piece.mesh.hexes), ends)
        halves = np.stack([ends, np.stack([middles] * 2, axis=1)], axis=-1).reshape(-1, 2)
        shape = len(control), len(self.mesh.vertices)
        halving = csr_matrix((halving.data, used[halving.indices], halving.indptr), shape)
        straight = (8 * piece.straight[:, None] + np.arange(8)).ravel()
        return ControlMesh(finer, halves, piece.corner_vertices, straight), halving

    def _part(self, elements: np.ndarray) -> tuple[ControlMesh, np.ndarray]:
        """The part of some hexes, and its vertices (ascending)."""
        mesh, used = part(self.mesh, elements, self.sides)
        number = np.full(len(self.mesh.vertices), -1)
        number[used] = np.arange(len(used))
        sharp = np.sort(number[self.sharp_edges], axis=1)
        sharp = sharp[_places(edges(mesh.hexes), sharp) >= 0]
        tips = number[self.corner_vertices]
        straight = np.flatnonzero(np.isin(elements, self.straight))
        return ControlMesh(mesh, sharp, tips[tips >= 0], straight), used


def _places(rows: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Index of each wanted row in `rows`, which are distinct and sorted; -1 if it is missing."""
    base = max(rows.max(initial=0), wanted.max(initial=0)) + 1
    keys, key = rows @ [base, 1], wanted @ [base, 1]
    place = np.minimum(np.searchsorted(keys, key), len(keys) - 1)
    return np.where(keys[place] == key, place, -1)
