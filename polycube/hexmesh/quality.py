"""Volume of a hex mesh, and its distances from a surface and its creases.

Distances are exact (closest points on triangles) at samples, as fractions of the diagonal of the
bounding box of the surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polycube.surface import closest
from polycube.surface.fit_target import Target, target
from polycube.surface.measures import edges
from polycube.types import HexMesh, TriMesh

_GRID = np.array([1, 3, 5]) / 6
# weights of the corners of a quad: 9 points inside, then the corners
SHARES = np.concatenate(
    [
        [[(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v] for u in _GRID for v in _GRID],
        np.eye(4),
    ]
)
STEP = 0.004  # spacing of the samples on creases, in diagonals


@dataclass(frozen=True)
class Distances:
    """Statistics of the distances of sample points from a surface, as fractions of the diagonal."""

    largest: float
    mean: float
    p99: float  # exceeded by 1 % of the points

    @classmethod
    def of(cls, values: np.ndarray) -> Distances:
        """Statistics of distances (N,)."""
        largest, mean, p99 = values.max(), values.mean(), np.percentile(values, 99)
        return cls(float(largest), float(mean), float(p99))


@dataclass(frozen=True)
class Deviation:
    """Distances between the boundary of a hex mesh and a surface, in both directions."""

    vertices: float  # largest distance of a boundary vertex from the surface
    to_surface: Distances  # from points of the boundary
    to_mesh: Distances  # from points of the surface

    @property
    def p99(self) -> float:
        """Distance exceeded by 1 % of the points, the larger one of both directions."""
        return max(self.to_surface.p99, self.to_mesh.p99)


@dataclass(frozen=True, eq=False)
class Samples:
    """Points of one surface with their closest points on another, at unit scale."""

    points: np.ndarray  # (N, 3)
    feet: np.ndarray  # (N, 3) closest points on the other surface
    distance: np.ndarray  # (N,)
    quad: np.ndarray  # (N,) boundary quad of the hex mesh at the point or its closest point


def volume(mesh: HexMesh) -> float:
    """Volume inside the bilinear boundary quads."""
    centre = mesh.vertices.mean(axis=0)  # reduces rounding errors for a part far from the origin
    a, b, c, d = np.moveaxis(mesh.vertices[mesh.quads] - centre, 1, 0)
    # The mean over both diagonals of a quad is exact for a bilinear quad.
    halves = ((a, b, c), (a, c, d), (a, b, d), (b, c, d))
    return float(sum(np.einsum("qd,qd->", p, np.cross(q, r)) for p, q, r in halves) / 12)


def triangles(vertices: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """(4 Q, 3, 3) four triangles of each quad (Q, 4), around its centre."""
    corner = vertices[quads]  # (Q, 4, 3)
    middle = np.broadcast_to(corner.mean(axis=1, keepdims=True), corner.shape)
    return np.stack([corner, np.roll(corner, -1, axis=1), middle], axis=2).reshape(-1, 3, 3)


def deviation(mesh: HexMesh, surface: TriMesh, samples: int = 8000) -> Deviation:
    """Distances between mesh and surface, in both directions.

    samples : number of points on the surface, in addition to its vertices; each quad has 13 points
    """
    return deviation_of(boundary_samples(mesh, surface), surface_samples(mesh, surface, samples))


def deviation_of(on_boundary: Samples, on_surface: Samples) -> Deviation:
    """Deviation from the samples of both surfaces."""
    there = on_boundary.distance
    vertices = there.reshape(-1, len(SHARES))[:, -4:]
    return Deviation(float(vertices.max()), Distances.of(there), Distances.of(on_surface.distance))


def boundary_samples(mesh: HexMesh, surface: TriMesh) -> Samples:
    """13 points of each boundary quad, and the closest points of the surface."""
    goal = target(surface)
    corners = goal.to_unit(mesh.vertices)[mesh.quads]
    points = np.einsum("sk,qkd->qsd", SHARES, corners).reshape(-1, 3)
    feet, _ = goal.closest(points)
    quad = np.repeat(np.arange(len(mesh.quads)), len(SHARES))
    return Samples(points, feet, np.linalg.norm(points - feet, axis=1), quad)


def surface_samples(mesh: HexMesh, surface: TriMesh, number: int) -> Samples:
    """`number` points of the surface and its vertices, with the closest points of the boundary."""
    goal = target(surface)
    tree = closest.tree(triangles(goal.to_unit(mesh.vertices), mesh.quads))
    points = np.concatenate([goal.samples(number)[0], goal.surface.vertices])
    feet, face, _ = closest.closest(tree, points)
    return Samples(points, feet, np.linalg.norm(points - feet, axis=1), face // 4)


def off_creases(goal: Target, edges: np.ndarray) -> float:
    """Distance from edges (N, 2, 3) exceeded by 5 % of the creases of the surface; unit scale."""
    if not goal.features.creases:
        return 0.0
    tree = closest.tree(edges[:, [0, 1, 1]])
    points = [
        crease.at(np.linspace(0, crease.length, 2 + int(crease.length / STEP)))[0]
        for crease in goal.features.creases
    ]
    return float(np.percentile(closest.distance(tree, np.concatenate(points)), 95))


def creases_to_edges(mesh: HexMesh, surface: TriMesh) -> float:
    """Distance from the boundary edges of the mesh exceeded by 5 % of the creases of the surface.

    It is a fraction of the diagonal; 0 if the surface has no creases.
    """
    goal = target(surface)
    return off_creases(goal, boundary_edges(mesh, goal))


def boundary_edges(mesh: HexMesh, goal: Target) -> np.ndarray:
    """(E, 2, 3) ends of the edges of the boundary quads, at unit scale."""
    return goal.to_unit(mesh.vertices)[edges(mesh.quads)[0]]
