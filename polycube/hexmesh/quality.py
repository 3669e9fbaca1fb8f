"""How good a hex mesh is: scaled Jacobian, volume, distances to the surface, one score.

Distances are exact (closest point on triangles), taken at samples, as fractions of the diagonal
of the surface's bounding box.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from polycube.hexmesh import energy
from polycube.hexmesh.connectivity import unique_rows
from polycube.surface import closest
from polycube.surface import measures as surfaces
from polycube.surface.fit_target import Target, target
from polycube.types import HexMesh, TriMesh

BEST_SCORE = 0.6  # a scaled Jacobian counts in full up to this
ENOUGH = 0.57  # score that ends the search: that hex, with creases .9 % off the mesh's edges
BEYOND = 0.25  # what a scaled Jacobian counts beyond that
CREASES = 0.003  # of the diagonal: as far may 5 % of the creases be from the mesh's edges
INVALID = 1e6  # what an inverted hex costs: any valid mesh is better

_GRID = np.array([1, 3, 5]) / 6
# shares of the corners of a quad: 9 points inside, then the corners
SHARES = np.concatenate(
    [
        [[(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v] for u in _GRID for v in _GRID],
        np.eye(4),
    ]
)


# a mesh beyond one of these is doubted
LEAST_JACOBIAN = 0.2
OFF_SURFACE = 0.005  # of the diagonal, for boundary vertices
APART = 0.045  # of the diagonal, for all sampled points, both ways
VOLUME_OFF = 0.04  # of the surface's volume


@dataclass(frozen=True)
class Distances:
    """Of sampled points of one surface from another, as fractions of the diagonal."""

    largest: float
    mean: float
    p99: float  # exceeded by one point in a hundred

    @classmethod
    def of(cls, values: np.ndarray) -> Distances:
        """Of the distances (N,)."""
        largest, mean, p99 = values.max(), values.mean(), np.percentile(values, 99)
        return cls(float(largest), float(mean), float(p99))


@dataclass(frozen=True)
class Deviation:
    """Two-sided distance of a hex mesh's boundary and a surface."""

    vertices: float  # largest distance of a boundary vertex from the surface
    to_surface: Distances  # from points of the boundary
    to_mesh: Distances  # from points of the surface


@dataclass(frozen=True)
class Quality:
    """What decides whether a mesh is accepted."""

    scaled_jacobian: float  # smallest
    deviation: Deviation
    creases: float  # distance from the mesh's edges that 5 % of the surface's creases exceed
    volume_ratio: float  # of the mesh to the surface


def scaled_jacobian(vertices: np.ndarray, hexes: np.ndarray) -> np.ndarray:
    """(H,) smallest scaled Jacobian of each hex, in [-1, 1]: VTK's number.

    det(a, b, c) / (|a| |b| |c|), least over the edges at the 8 corners and the principal axes at
    the centre; at most 0 where the hex is inverted or flat, -1 where an edge has no length.
    """
    return energy.scaled_jacobian(
        np.ascontiguousarray(vertices, np.float64), np.ascontiguousarray(hexes, np.int64)
    )


def volume(mesh: HexMesh) -> float:
    """Volume inside the bilinear boundary quads."""
    centre = mesh.vertices.mean(axis=0)  # a far placement would cost digits
    a, b, c, d = np.moveaxis(mesh.vertices[mesh.quads] - centre, 1, 0)
    # the mean of both ways to cut a quad in two triangles is exact for a bilinear quad
    six = sum(
        np.einsum("qd,qd->", p, np.cross(q, r))
        for p, q, r in ((a, b, c), (a, c, d), (a, b, d), (b, c, d))
    )
    return float(six / 12)


def triangles(vertices: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """(4 Q, 3, 3) four triangles of each quad (Q, 4), round its middle."""
    corner = vertices[quads]  # (Q, 4, 3)
    middle = np.broadcast_to(corner.mean(axis=1, keepdims=True), corner.shape)
    return np.stack([corner, np.roll(corner, -1, axis=1), middle], axis=2).reshape(-1, 3, 3)


def deviation(mesh: HexMesh, surface: TriMesh, samples: int = 8000) -> Deviation:
    """Distances of mesh and surface, both ways.

    samples : number of points on the surface, besides its vertices; 13 are taken on each quad
    """
    goal = target(surface)
    places = goal.to_unit(mesh.vertices)
    inside = np.einsum("sk,qkd->qsd", SHARES, places[mesh.quads]).reshape(-1, 3)
    there = closest.distance(goal.tree, inside)
    faces = triangles(places, mesh.quads)
    back = closest.tree(faces, np.zeros((len(faces), 3)))
    points = np.concatenate([goal.samples(samples)[0], goal.surface.vertices])
    here = closest.distance(back, points)
    on = there.reshape(-1, len(SHARES))[:, -4:]
    return Deviation(float(on.max()), Distances.of(there), Distances.of(here))


def off_creases(goal: Target, edges: np.ndarray, step: float = 0.004) -> float:
    """Distance that 5 % of the surface's creases are from edges (N, 2, 3), at least; unit scale.

    step : between the points taken on the creases
    """
    if not goal.features.creases:
        return 0.0
    tree = closest.tree(edges[:, [0, 1, 1]], np.zeros((len(edges), 3)))
    points = [
        crease.at(np.linspace(0, crease.length, 2 + int(crease.length / step)))[0]
        for crease in goal.features.creases
    ]
    return float(np.percentile(closest.distance(tree, np.concatenate(points)), 95))


def creases_to_edges(mesh: HexMesh, surface: TriMesh) -> float:
    """Distance from the mesh's boundary edges that 5 % of the surface's creases exceed.

    A fraction of the diagonal; 0 where the surface has no creases.
    """
    goal = target(surface)
    sides = np.stack([mesh.quads, np.roll(mesh.quads, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges = goal.to_unit(mesh.vertices)[unique_rows(np.sort(sides, axis=1))[0]]
    return off_creases(goal, edges)


@lru_cache(maxsize=4)
def quality(mesh: HexMesh, surface: TriMesh) -> Quality:
    """Measure a mesh against the surface it was made for; kept, for score and doubts ask alike."""
    return Quality(
        float(scaled_jacobian(mesh.vertices, mesh.hexes).min()),
        deviation(mesh, surface),
        creases_to_edges(mesh, surface),
        volume(mesh) / surfaces.volume(surface),
    )


def worth(jacobian: float, vertices: float, creases: float) -> float:
    """What the score counts of the worst hex, and of boundary vertices and creases that miss."""
    return (
        min(jacobian, BEST_SCORE)
        + BEYOND * max(0, jacobian - BEST_SCORE)
        - INVALID * (jacobian <= 0)
        - 20 * max(0, vertices - 0.001)
        - 5 * max(0, creases - CREASES)
    )


def score(mesh: HexMesh, surface: TriMesh) -> float:
    """One number to choose by, larger is better: the worst hex, less what misses the surface.

    The scaled Jacobian counts in full up to 0.6, by a quarter beyond; the vertices may miss by
    0.1 % of the diagonal, 99 % of the points by 1 %, 95 % of the creases by 0.3 %, the volume by
    3 %.
    """
    q = quality(mesh, surface)
    miss = max(q.deviation.to_surface.p99, q.deviation.to_mesh.p99)
    return (
        worth(q.scaled_jacobian, q.deviation.vertices, q.creases)
        - 5 * max(0, miss - 0.01)
        - 4 * max(0, abs(q.volume_ratio - 1) - 0.03)
    )


def doubts(mesh: HexMesh, surface: TriMesh) -> list[str]:
    """Why the mesh should not be used without a look, a sentence each; none where it may be."""
    q = quality(mesh, surface)
    farthest = max(q.deviation.to_surface.largest, q.deviation.to_mesh.largest)
    findings = {
        f"the smallest scaled Jacobian is {q.scaled_jacobian:.3f}, below {LEAST_JACOBIAN}": (
            q.scaled_jacobian < LEAST_JACOBIAN
        ),
        f"boundary vertices lie up to {q.deviation.vertices:.2%} of the diagonal off the surface, "
        f"more than {OFF_SURFACE:.1%}": q.deviation.vertices >= OFF_SURFACE,
        f"mesh and surface are up to {farthest:.1%} of the diagonal apart, more than "
        f"{APART:.1%}": farthest >= APART,
        f"the volume is {q.volume_ratio:.1%} of the surface's, more than {VOLUME_OFF:.0%} off": abs(
            q.volume_ratio - 1
        )
        >= VOLUME_OFF,
    }
    return [sentence for sentence, holds in findings.items() if holds]


def accept(mesh: HexMesh, surface: TriMesh) -> bool:
    """Whether the mesh may be used without a look."""
    return not doubts(mesh, surface)
