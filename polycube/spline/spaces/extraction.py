"""The spline of a hex mesh as one sparse matrix from control points to shared Bezier nodes.

A Bezier node belongs to an entity (vertex, edge, face or body of the mesh) and to the closest
corner of it, so that neighbours share it. It lies in a stratum of dimension d: 3 inside, 2 on the
smooth boundary, 1 on a sharp curve, 0 at a sharp corner. Its row is the mean over the d-cells
around the entity of sum_w (2/3)^(d-m) (1/3)^m e_w, where w are the corners of the cell and m is the
number of directions in which w differs from the closest corner (the hex-to-spline construction of
TH-spline3D, level 0).

A hex may be straight: its faces, edges and vertices are then separate strata, so that its map is
the trilinear one of its corners, and it is only continuous with its neighbours.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy.sparse import csr_matrix

from polycube.hexmesh.connectivity import extraordinary_edges, quad_sides, unique_rows
from polycube.spline.spaces.sharp_features import is_among
from polycube.types import HexMesh, Spline

TENSOR = np.array([0, 1, 3, 2, 4, 5, 7, 6])  # VTK corner at tensor position i + 2 j + 4 k
# node from corners in one dimension
NEAREST = np.array([[2.0, 1.0], [2.0, 1.0], [1.0, 2.0], [1.0, 2.0]]) / 3
FREE = 2  # an axis along which an entity extends; 0 and 1 are the side on which it lies


def _local(fixed: list[int], free: list[int], base: int) -> list[np.ndarray]:
    """[d] (n_d, n^d) tensor positions in the 8 vertices, 12 edges, 6 faces and body of a hex."""
    tables: list[list[list[int]]] = [[], [], [], []]
    for entity in product((0, 1, FREE), repeat=3):
        z, y, x = (free if side == FREE else [fixed[side]] for side in entity)
        places = [i + base * j + base**2 * k for k, j, i in product(z, y, x)]
        tables[entity.count(FREE)].append(places)
    return [np.array(table) for table in tables]


CORNERS = _local([0, 1], [0, 1], 2)  # the corners of each entity
OWN = _local([0, 3], [1, 2], 4)  # its Bezier nodes closest to those corners
CLOSURE = _local([0, 3], [0, 1, 2, 3], 4)  # its Bezier nodes and those of its sides
NO_INDICES = np.zeros(0, np.int64)
DIMENSIONS = 3, 2, 1, 0  # of the strata, in this order
Cells = tuple[np.ndarray, np.ndarray]  # of dimension d: corners (c, 2^d) and Bezier nodes (c, 4^d)


@dataclass(frozen=True, eq=False)
class OnHexes:
    """Common properties of the spline spaces of a whole hex mesh."""

    mesh: HexMesh

    @cached_property
    def sides(self) -> np.ndarray:
        """(Q, 2) hex and local face of each boundary quad."""
        return np.stack(quad_sides(self.mesh), axis=1)

    @property
    def patch(self) -> np.ndarray:
        """(Q,) patch of each boundary quad."""
        return self.mesh.patch


def volumetric_spline(
    mesh: HexMesh,
    sharp_edges: np.ndarray,
    corner_vertices: np.ndarray = NO_INDICES,
    straight: np.ndarray = NO_INDICES,
) -> Spline:
    """The spline whose control points are the vertices of the mesh.

    The surface is smooth except at sharp edges. det J is 0 along a smooth boundary edge with a
    single hex. Raises ValueError for sharp edges and corners that are not on the boundary, and for
    vertices without a hex.

    sharp_edges : (S, 2) ends of boundary edges that remain sharp curves. A vertex with exactly two
        of them lies on the curve; a vertex with one or more than two is a corner
    corner_vertices : additional corners
    straight : hexes that stay trilinear
    """
    extraction, nodes = extraction_matrix(mesh, sharp_edges, corner_vertices, straight)
    return Spline(
        control=mesh.vertices,
        extraction=extraction,
        nodes=nodes,
        element_hex=np.arange(len(mesh.hexes)),
        level=np.zeros(len(mesh.hexes)),
        sides=np.stack(quad_sides(mesh), axis=1),
        patch=mesh.patch,
        extraordinary_edges=len(extraordinary_edges(mesh)[0]),
    )


def extraction_matrix(
    mesh: HexMesh,
    sharp_edges: np.ndarray,
    corner_vertices: np.ndarray = NO_INDICES,
    straight: np.ndarray = NO_INDICES,
) -> tuple[csr_matrix, np.ndarray]:
    """Rows (B, C) of all Bezier nodes and the nodes (H, 64) of each hex; see volumetric_spline."""
    corners = mesh.hexes[:, TENSOR]
    nodes, numbers = bezier_nodes(corners)
    unused = len(mesh.vertices) - numbers[0].max() - 1
    if unused:
        raise ValueError(f"hex mesh has {unused} vertices that no hex uses")
    ends, count = np.unique(sharp_edges, return_counts=True)
    tips = np.union1d(ends[count != 2], corner_vertices)
    strata = _strata(corners, nodes, numbers, np.sort(sharp_edges, axis=1), tips, straight)
    return _extraction(strata, nodes.max() + 1, len(mesh.vertices)), nodes


def bezier_nodes(corners: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
    """Shared Bezier nodes (H, 64), and the number of each local entity: [d] (H, n_d).

    corners : (H, 8) vertices of each hex in tensor order
    """
    nodes = np.zeros((len(corners), 64), np.int64)
    numbers, start = [], 0
    for d in range(4):
        ends = corners[:, CORNERS[d]]  # (H, n_d, 2^d)
        rank = (ends[..., :, None] > ends[..., None, :]).sum(axis=-1)
        distinct, inverse, _ = unique_rows(np.sort(ends, axis=-1).reshape(-1, 2**d))
        number = inverse.reshape(ends.shape[:2])
        nodes[:, OWN[d]] = start + number[..., None] * 2**d + rank
        start += len(distinct) * 2**d
        numbers.append(number)
    return nodes, numbers


def _strata(
    corners: np.ndarray,
    nodes: np.ndarray,
    numbers: list[np.ndarray],
    sharp_edges: np.ndarray,
    tips: np.ndarray,
    straight: np.ndarray,
) -> list[Cells]:
    """The cells of dimension 3, 2, 1, 0 that determine the nodes; later ones have precedence."""

    def cells(d: int, hexes: np.ndarray, local: np.ndarray) -> Cells:
        at = hexes[:, None]
        return corners[at, CORNERS[d][local]], nodes[at, CLOSURE[d][local]]

    hexes = np.arange(len(corners))
    outside = np.bincount(numbers[2].ravel())[numbers[2]] == 1  # (H, 6)
    edge_ends = np.sort(corners[:, CORNERS[1]], axis=-1)  # (H, 12, 2)
    sharp = is_among(edge_ends, sharp_edges)
    curves, quads = cells(1, *_first(numbers[1], sharp))[0], cells(2, *np.nonzero(outside))[0]
    _check_sharp(sharp_edges, tips, curves, quads)
    own = [np.isin(n, n[straight]) for n in numbers]  # [d] (H, n_d) entities of straight hexes
    return [
        cells(3, hexes, np.zeros_like(hexes)),
        cells(2, *_first(numbers[2], outside | own[2])),
        cells(1, *_first(numbers[1], sharp | own[1])),
        cells(0, *_first(numbers[0], np.isin(corners, tips) | own[0])),
    ]


def _first(numbers: np.ndarray, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Hex and local number of an occurrence of each chosen entity."""
    hexes, local = np.nonzero(chosen)
    _, first = np.unique(numbers[hexes, local], return_index=True)
    return hexes[first], local[first]


def _check_sharp(
    sharp_edges: np.ndarray, tips: np.ndarray, curves: np.ndarray, quads: np.ndarray
) -> None:
    """Raise ValueError unless sharp edges and corners are on the boundary, without duplicates."""
    sides = np.sort(quads[:, [[0, 1], [2, 3], [0, 2], [1, 3]]], axis=-1)
    known = is_among(sharp_edges, sides.reshape(-1, 2))
    if not known.all():
        what = f"sharp edge {sharp_edges[np.argmin(known)].tolist()} is not on the boundary"
        raise ValueError(what)
    if len(curves) != len(sharp_edges):
        raise ValueError(f"{len(sharp_edges) - len(curves)} sharp edges are given twice")
    inside = np.setdiff1d(tips, quads)
    if len(inside):
        raise ValueError(f"corner vertex {inside[0]} is not on the boundary")


def _extraction(strata: list[Cells], n_nodes: int, n_vertices: int) -> csr_matrix:
    """(B, C) rows of all nodes, each from the last stratum that contains it.

    A row is the mean over the cells around the node of their trilinear weights at thirds.
    """
    dimension = np.zeros(n_nodes, np.int64)
    for d, (_, nodes) in zip(DIMENSIONS, strata, strict=True):
        dimension[nodes] = d
    parts = []
    for d, (corners, nodes) in zip(DIMENSIONS, strata, strict=True):
        weights: np.ndarray = np.ones((1, 1))
        for _ in range(d):
            weights = np.kron(weights, NEAREST)
        at = np.flatnonzero(dimension[nodes.ravel()] == d)
        node, (cell, local) = nodes.ravel()[at], np.divmod(at, len(weights))
        shares = weights[local] / np.bincount(node)[node, None]
        columns, starts = corners[cell].ravel(), np.arange(len(at) + 1) * weights.shape[1]
        each = csr_matrix((shares.ravel(), columns, starts), (len(at), n_vertices))
        ends = node, np.arange(len(at))
        parts.append(csr_matrix((np.ones(len(at)), ends), (n_nodes, len(at))) @ each)
    rows = sum(parts)
    rows.sort_indices()
    return rows
