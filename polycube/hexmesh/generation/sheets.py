"""Insert a sheet of hexes around a set of hexes, which shrinks (pillowing).

Mitchell and Tautges 1995, "Pillowing doublets: refining a mesh to ensure that faces share at most
one edge". The sheet lies between the set and all other hexes and ends at the boundary.
"""

from functools import lru_cache

import numpy as np

from polycube.hexmesh import connectivity
from polycube.surface.measures import edges, fans
from polycube.types import HexMesh


def has_sheet(mesh: HexMesh, inside: np.ndarray) -> bool:
    """Whether a sheet around hexes (H,) is a surface, without pinched edges and vertices."""
    faces = mesh.hexes[:, connectivity.FACES].reshape(-1, 4)[_faces_between(mesh, inside)]
    if len(faces) == 0:
        return False
    if (edges(faces)[1] > 2).any():
        return False
    return bool(fans(faces).max() + 1 == len(np.unique(faces)))


def with_sheet(mesh: HexMesh, inside: np.ndarray, depth: float = 0.5) -> HexMesh:
    """The mesh with a sheet of hexes around some of its hexes.

    Vertices between the set and the other hexes keep their positions; those of the set move
    inwards. Boundary quads of the sheet get the patch of the adjacent quad of the set.

    mesh : hex mesh; if it is a part of another mesh, its quads are the boundary quads of that mesh
    inside : (H,) bool, the set; see `has_sheet`
    depth : how far vertices of the set move towards the centres of its hexes, or on the boundary
        towards those of its quads, as a share of the distance
    """
    between = _faces_between(mesh, inside)
    outer = mesh.hexes[:, connectivity.FACES].reshape(-1, 4)[between]
    moved = np.unique(outer)
    twin = np.arange(len(mesh.vertices))
    twin[moved] = len(mesh.vertices) + np.arange(len(moved))
    quads = mesh.quads
    own = inside[connectivity.quad_sides(mesh)[0]]
    place = middles(mesh.hexes[inside], mesh.vertices)
    on_rim = np.intersect1d(moved, quads[own])
    place[on_rim] = middles(quads[own], mesh.vertices)[on_rim]
    shrunk = mesh.vertices[moved] + depth * (place[moved] - mesh.vertices[moved])
    hexes = np.where(inside[:, None], twin[mesh.hexes], mesh.hexes)
    hexes = np.vstack([hexes, np.hstack([twin[outer], outer])])
    sides, pair = connectivity.quad_edges(quads, is_closed=False)
    mixed = own[pair[:, 0]] != own[pair[:, 1]]
    rim = sides[mixed]
    inner_quad = np.where(own[pair[mixed, 0]], pair[mixed, 0], pair[mixed, 1])
    boundary = np.where(own[:, None], twin[quads], quads)
    table = np.vstack([boundary, np.hstack([rim, twin[rim][:, ::-1]])])
    outside, _ = connectivity.exposed(hexes)
    known = connectivity.label_of(outside, table, np.arange(1, len(table) + 1))
    return connectivity.hex_mesh(
        np.vstack([mesh.vertices, shrunk]),
        hexes,
        outside[known > 0],
        np.append(mesh.patch, mesh.patch[inner_quad])[known[known > 0] - 1],
        np.append(mesh.cell, mesh.cell[between // 6]),
    )


def _faces_between(mesh: HexMesh, inside: np.ndarray) -> np.ndarray:
    """Faces of hexes inside that border on hexes outside, as numbers 6 hex + local face."""
    first, second = _neighbours(mesh)
    mixed = inside[first // 6] != inside[second // 6]
    return np.where(inside[first[mixed] // 6], first[mixed], second[mixed])


@lru_cache(maxsize=1)  # many sets of one mesh are tested
def _neighbours(mesh: HexMesh) -> tuple[np.ndarray, np.ndarray]:
    return connectivity.neighbours(mesh.hexes)


def middles(cells: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """(V, 3) mean of the centres of the cells at each vertex; zero if there is none."""
    corners, n = cells.ravel(), len(vertices)
    middle = np.repeat(vertices[cells].mean(axis=1), cells.shape[1], axis=0)
    total = np.stack([np.bincount(corners, m, minlength=n) for m in middle.T], axis=1)
    return total / np.maximum(np.bincount(corners, minlength=n), 1)[:, None]
