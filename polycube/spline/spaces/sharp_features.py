"""Boundary edges (S, 2) and vertices (P,) of a hex mesh that remain sharp in the spline.

In the mesh of a CAD part, they are on curves at which the CAD faces turn.
"""

import numpy as np
from scipy.spatial import cKDTree

from polycube.hexmesh.connectivity import FACES, edge_valence, quad_edges
from polycube.hexmesh.named_sets import cad_faces
from polycube.surface.fit_target import target
from polycube.types import HexMesh, TriMesh


def creases(mesh: HexMesh, angle: float) -> np.ndarray:
    """Boundary edges whose two quads have normals more than `angle` radians apart."""
    edges, quads = quad_edges(mesh.quads)
    corners = mesh.vertices[mesh.quads]
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    return edges[_angle(normals[quads[:, 0]], normals[quads[:, 1]]) > angle]


def border(mesh: HexMesh, quads: np.ndarray) -> np.ndarray:
    """Boundary edges between some quads (F,), indices of `mesh.quads`, and others."""
    edges, sides = quad_edges(mesh.quads)
    return edges[np.isin(sides, quads).sum(axis=1) == 1]


def single_hex_edges(mesh: HexMesh) -> np.ndarray:
    """Boundary edges with one hex; if they were smooth, det J would be 0 along them."""
    edges, count = edge_valence(mesh.hexes)
    return edges[count == 1]


def edges_between(mesh: HexMesh, vertices: np.ndarray) -> np.ndarray:
    """Boundary edges with both ends in a list of vertices, including chords across a face."""
    edges, _ = quad_edges(mesh.quads)
    return edges[np.isin(edges, vertices).all(axis=1)]


def without_dead_ends(sharp_edges: np.ndarray) -> np.ndarray:
    """The edges on closed curves or on curves between these; edges with loose ends are dropped."""
    while len(sharp_edges):
        remains = (np.bincount(sharp_edges.ravel())[sharp_edges] > 1).all(axis=1)
        if remains.all():
            break
        sharp_edges = sharp_edges[remains]
    return sharp_edges


def kinks(mesh: HexMesh, sharp_edges: np.ndarray, angle: float) -> np.ndarray:
    """Vertices where a curve of sharp edges turns by more than `angle` radians."""
    passages = _passages(sharp_edges)
    before, vertex, after = mesh.vertices[passages.T]
    return passages[_angle(vertex - before, after - vertex) > angle, 1]


def folds(mesh: HexMesh, sharp_edges: np.ndarray) -> np.ndarray:
    """Vertices where a curve turns from one edge of a face to the next: det J would be 0."""
    passages = _passages(sharp_edges)
    turns = np.stack([np.roll(FACES, shift, axis=1) for shift in (-1, 0, 1)], axis=-1)
    turns = mesh.hexes[:, turns].reshape(-1, 3)
    turns[:, ::2].sort(axis=1)
    base = np.int64(len(mesh.vertices))  # base^3 is representable up to two million vertices
    return passages[np.isin(passages @ [base**2, base, 1], turns @ [base**2, base, 1]), 1]


def union(*lists: np.ndarray) -> np.ndarray:
    """Union of edges or vertices, without duplicates."""
    return np.unique(np.concatenate(lists), axis=0)


def is_among(edges: np.ndarray, others: np.ndarray) -> np.ndarray:
    """(...) whether edges (..., 2) are among others (E, 2); all ends are ascending."""
    base = max(edges.max(initial=0), others.max(initial=0)) + 1
    return np.isin(edges @ [base, 1], others @ [base, 1])


def _passages(sharp_edges: np.ndarray) -> np.ndarray:
    """(P, 3) vertices before, at and after each vertex with two sharp edges, the ends ascending."""
    tails, heads = sharp_edges.ravel(), sharp_edges[:, ::-1].ravel()
    order = np.lexsort((heads, tails))
    vertices, first, count = np.unique(tails[order], return_index=True, return_counts=True)
    heads, first = heads[order], first[count == 2]
    return np.stack([heads[first], vertices[count == 2], heads[first + 1]], axis=1)


def _angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(N,) radians between vectors (N, 3)."""
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1))


def cad_edges(mesh: HexMesh, surface: TriMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Boundary edges, and the angle of the part there if they lie on a curve between CAD faces.

    Returns vertices (N, 2), ascending, the two quads (N, 2), and the angle (N,) inside the solid in
    radians, which is pi away from these curves.

    mesh : hex mesh with the sets of its CAD faces
    surface : surface with its CAD faces as `region`
    """
    goal, face = target(surface), cad_faces(mesh)
    edges, quads = quad_edges(mesh.quads)
    adjacent = np.sort(face[quads], axis=1)
    middle = goal.to_unit(mesh.vertices)[edges].mean(axis=1)
    nearest, inside = np.full(len(edges), np.inf), np.full(len(edges), np.pi)
    for crease in goal.followed.creases:
        is_between = adjacent[:, 0] != adjacent[:, 1]
        own = np.flatnonzero((adjacent == crease.faces).all(axis=1) & is_between)
        arc, off = crease.nearest(middle[own])
        own, arc, off = (part[off < nearest[own]] for part in (own, arc, off))
        nearest[own], inside[own] = off, crease.at(arc)[2]
    return edges, quads, inside


def cad_corners(mesh: HexMesh, surface: TriMesh) -> np.ndarray:
    """(P,) boundary vertices closest to the ends of the curves of a part, and to tips of cones."""
    goal, outside = target(surface), np.unique(mesh.quads)
    corners = goal.followed.corners
    if not len(corners):
        return outside[:0]
    return np.unique(outside[cKDTree(goal.to_unit(mesh.vertices[outside])).query(corners)[1]])
