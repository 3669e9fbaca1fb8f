"""Number of hexes through a wall and of edges around a hole, from the quads of a face."""

import numpy as np

from polycube.hexmesh.connectivity import neighbours, quad_sides
from polycube.surface.measures import connected, open_edges
from polycube.types import HexMesh

RIM = 0.5  # of the longest border curve: shorter curves do not count


def through(mesh: HexMesh) -> tuple[np.ndarray, np.ndarray]:
    """Follow opposite faces of hexes from every boundary quad to the boundary.

    Returns (Q,) the number of hexes on each path, and (Q,) the number of the quad at its end.
    """
    side = np.arange(0, 6 * len(mesh.hexes), 2)  # opposite sides of a hex are consecutive
    first, second = neighbours(mesh.hexes)
    path = connected(np.append(side, first), np.append(side + 1, second), 6 * len(mesh.hexes))
    own = path.reshape(-1, 6)[quad_sides(mesh)]
    end, ends = np.empty(len(own), np.int64), np.argsort(own, kind="stable").reshape(-1, 2)
    end[ends] = ends[:, ::-1]
    return np.bincount(path)[own] // 2, end


def rims(points: np.ndarray, faces: np.ndarray) -> list[np.ndarray]:
    """Find the closed curves that bound some faces of a closed surface.

    Curves shorter than half the longest one are ignored: they belong to a smaller hole in the wall
    of a larger one. Returns (E, 2) edges of each curve, unordered; none if the faces have no
    border.

    points : (V, 3)
    faces : (N, K) indices of points, counter-clockwise from outside
    """
    border = open_edges(faces)
    group = connected(border[:, 0], border[:, 1], len(points))[border[:, 0]]
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
