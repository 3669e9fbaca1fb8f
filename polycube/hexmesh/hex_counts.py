"""Number of hexes through a wall and of edges around a hole, from the quads of a face."""

import numpy as np

from polycube.hexmesh.connectivity import neighbours, on_faces, quad_sides
from polycube.surface.measures import connected, half_edges
from polycube.types import HexMesh

RIM = 0.5  # of the longest border curve: shorter curves do not count


def through(mesh: HexMesh) -> tuple[np.ndarray, np.ndarray]:
    """Follow opposite faces of hexes from every boundary quad to the boundary.

    Returns
    -------
    count : (Q,) number of hexes on the path
    end : (Q,) number of the boundary quad at the end of the path
    """
    beyond = np.full(6 * len(mesh.hexes), -1)
    first, second = neighbours(mesh.hexes)
    beyond[first], beyond[second] = second, first
    owner, side = quad_sides(mesh)
    start = 6 * owner + side
    quad = on_faces(mesh, np.arange(len(start))).ravel()
    face, count, active = start ^ 1, np.ones(len(start), np.int64), np.arange(len(start))
    while len(active):
        active = active[beyond[face[active]] >= 0]
        face[active] = beyond[face[active]] ^ 1  # opposite faces of a hex have consecutive numbers
        count[active] += 1
    return count, quad[face]


def rims(points: np.ndarray, faces: np.ndarray) -> list[np.ndarray]:
    """Find the closed curves that bound some faces of a closed surface.

    Curves shorter than half the longest one are ignored: they belong to a smaller hole in the wall
    of a larger one.

    Parameters
    ----------
    points : (V, 3)
    faces : (N, K) indices of points, counter-clockwise from outside

    Returns
    -------
    (E, 2) edges of each curve, unordered; none if the faces have no border
    """
    edges = half_edges(faces)
    n = len(points)
    border = edges[~np.isin(edges @ [n, 1], edges @ [1, n])]
    group = connected(border[:, 0], border[:, 1], n)[border[:, 0]]
    curves = [border[group == k] for k in np.unique(group)]
    length = [curve_length(points, curve) for curve in curves]
    return [c for c, own in zip(curves, length, strict=True) if own >= RIM * max(length, default=0)]


def curve_length(points: np.ndarray, edges: np.ndarray) -> float:
    """Total length of edges (E, 2) between points (V, 3)."""
    return float(np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1).sum())


def around(mesh: HexMesh, quads: np.ndarray) -> int:
    """Number of mesh edges on the rim of a hole, the smallest of its rims; 0 without a rim.

    quads : (N,) numbers of the boundary quads of its wall
    """
    return min(map(len, rims(mesh.vertices, mesh.quads[quads])), default=0)


def edge_length(mesh: HexMesh, quads: np.ndarray) -> float:
    """Median side length of boundary quads (N,), in model units."""
    corners = mesh.vertices[mesh.quads[quads]]
    return float(np.median(np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)))
