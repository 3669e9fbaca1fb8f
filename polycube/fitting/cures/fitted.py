"""A fitted mesh with what its boundary is held to, and how good it is hex by hex."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from polycube.fitting.creases.constraints import Matching, held_exactly, match
from polycube.fitting.creases.paths import path_sides
from polycube.fitting.problem import FitProblem
from polycube.fitting.snapping import goals_of
from polycube.hexmesh.cad_faces import quad_regions
from polycube.hexmesh.connectivity import quad_sides
from polycube.hexmesh.feature_distances import MOST, TOLERANCE
from polycube.hexmesh.inspection import SAMPLES
from polycube.hexmesh.quality import triangles
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.surface import closest
from polycube.surface.fit_target import Target
from polycube.types import HexMesh

OFF = 50.0  # cost of a diagonal off the surface, beyond
NO_LOSS = 1e-3  # this distance
POWER = 4  # of the cost of a hex: one bad hex counts more than many that are nearly good
STRAYED = 100.0  # cost of a diagonal off exact features, beyond what is no loss
FEW = 1 - MOST / 100  # share of a feature that may be farther away than is tolerable
ROUND = 0.01  # round a CAD face, in diagonals: quads farther away do not count
LIMIT = 0.95 * TOLERANCE  # distance of features: a sample may be farther than the middles


@dataclass(frozen=True, eq=False)
class Fitted:
    """A mesh at unit scale near its target.

    Parameters
    ----------
    mesh : its `patch` is the number of each quad
    patch : (Q,) of the mesh that it comes from
    target : the surface
    paths : vertices on each curve, in order, by its number in `target.followed`
    corners : (P,) vertices on corners of the surface
    corner_goals : (P, 3) their places
    cad_face : (Q,) CAD face of each quad; 0 where it is not known
    gap : (V,) distances of boundary vertices from their goals
    strayed : (V,) distances from exact features, beyond what is no loss
    """

    mesh: HexMesh
    patch: np.ndarray
    target: Target
    paths: Mapping[int, np.ndarray]
    corners: np.ndarray
    corner_goals: np.ndarray
    cad_face: np.ndarray
    gap: np.ndarray
    strayed: np.ndarray

    @cached_property
    def sides(self) -> tuple[np.ndarray, np.ndarray]:
        """Hex (Q,) of each boundary quad, and which of its faces (Q,) it is."""
        return quad_sides(self.mesh)

    @cached_property
    def jacobian(self) -> np.ndarray:
        """(H,) scaled Jacobians."""
        return scaled_jacobian(self.mesh.vertices, self.mesh.hexes)

    def badness(self, aim: float) -> np.ndarray:
        """(H,) cost of each hex and of its vertices."""
        off = offness(self.gap, self.strayed)
        return poorness(self.jacobian, aim) + off[self.mesh.hexes].max(axis=1)

    @cached_property
    def lost(self) -> frozenset[tuple[str, int]]:
        """Kinds and numbers of the features that are too far from the mesh in too many places."""
        x, quads, creases = self.mesh.vertices, self.mesh.quads, self.target.followed.creases
        corners = np.linalg.norm(x[self.corners] - self.corner_goals, axis=1) > LIMIT
        lost = [("corner", k) for k in np.flatnonzero(corners).tolist()]
        for number, path in self.paths.items():
            crease = creases[number]
            ends = x[path_sides(path, crease.is_loop)]
            _, off = crease.nearest(ends.mean(axis=1))
            length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
            if length @ _far(off + crease.off) > FEW * length.sum():
                lost.append(("curve", number))
        cross = np.cross(x[quads[:, 2]] - x[quads[:, 0]], x[quads[:, 3]] - x[quads[:, 1]])
        area = np.linalg.norm(cross, axis=1)
        middles = x[quads].mean(axis=1)
        foot, _ = self.target.closest(middles, cad_face=self.cad_face)
        far = _far(np.linalg.norm(foot - middles, axis=1))
        whole, part = (np.bincount(self.cad_face, weights) for weights in (area, area * far))
        faces = np.flatnonzero(part > FEW * whole)
        lost += [("face", int(face)) for face in faces if face]
        return frozenset([*lost, *(("face without a quad", face) for face in self._bare())])

    def _bare(self) -> list[int]:
        """CAD faces that no quad is on; where paths do not enclose a face, quads near it count."""
        surface = self.target.surface
        known = np.unique(surface.region)
        if np.isin(known, self.cad_face).all():
            return []
        return np.setdiff1d(known, quad_regions(self.mesh, surface)[0]).tolist()

    def distance_of(self, face: int) -> float:
        """Distance from the mesh that some of the samples of a CAD face exceed; 0 without any."""
        points, _, of = self.target.samples(SAMPLES)
        points = points[of == face]
        if not len(points):
            return 0.0
        corners = self.mesh.vertices[self.mesh.quads]
        low, high = points.min(axis=0) - ROUND, points.max(axis=0) + ROUND
        near = ((corners.max(axis=1) > low) & (corners.min(axis=1) < high)).all(axis=1)
        if not near.any():
            return np.inf
        pieces = triangles(self.mesh.vertices, self.mesh.quads[near])
        tree = closest.tree(pieces, np.zeros((len(pieces), 3)))
        return float(np.percentile(closest.distance(tree, points), MOST))

    @cached_property
    def on_path(self) -> np.ndarray:
        """(N,) keys of the boundary edges on paths: (lower end) V + (higher end)."""
        ends = [
            path_sides(path, self.target.followed.creases[number].is_loop)
            for number, path in self.paths.items()
        ]
        return edge_keys(np.concatenate([np.zeros((0, 2), np.int64), *ends]), len(self.gap))


def fitted(mesh: HexMesh, target: Target) -> Fitted:
    """Prepare a mesh in model units that lies on its target."""
    unit = replace(mesh, vertices=target.to_unit(mesh.vertices), patch=np.arange(len(mesh.quads)))
    problem = FitProblem(unit, target, samples=1)
    matching = held_exactly(match(problem, unit.vertices), len(unit.vertices))
    gap, strayed = distances(problem, unit.vertices, matching)
    number = {id(crease): k for k, crease in enumerate(target.followed.creases)}
    paths = {number[id(route.crease)]: route.vertices for route in matching.routes}
    return Fitted(
        unit,
        mesh.patch,
        target,
        paths,
        matching.corner,
        matching.corner_goal,
        problem.cad_face,
        gap,
        strayed,
    )


def distances(
    problem: FitProblem, x: np.ndarray, matching: Matching
) -> tuple[np.ndarray, np.ndarray]:
    """Distances (V,) from the goals, and (V,) from exact features beyond what is no loss."""
    at = goals_of(problem, x, matching, np.ones(len(x)))
    gap = np.linalg.norm(at.place(problem, x) - x, axis=1)
    strayed = np.zeros(len(x))
    held = np.append(at.curve, at.corner)
    assert at.allowed is not None  # the matching is held exactly
    strayed[held] = np.maximum(0, gap[held] - at.allowed[held])
    return gap, strayed


def cost(
    jacobian: np.ndarray, gap: np.ndarray, strayed: np.ndarray, aim: float
) -> tuple[float, float]:
    """What hexes below the aim cost, and vertices off the surface; smaller is better.

    Returns
    -------
    the whole cost, and the smallest scaled Jacobian
    """
    least = float(jacobian.min())
    poor = float(poorness(jacobian, aim).sum()) + 10 * (least <= 0)
    return poor + float(offness(gap, strayed).max(initial=0)), least


def offness(gap: np.ndarray, strayed: np.ndarray) -> np.ndarray:
    """(V,) cost of vertices by their distances (V,) from their goals, and from exact features
    beyond what is no loss.
    """
    return OFF * np.maximum(0, gap - NO_LOSS) + STRAYED * strayed


def _far(sagitta: np.ndarray) -> np.ndarray:
    """Share of each arc farther from its chord than is tolerable, by their distance in the middle
    (N,).
    """
    return np.sqrt(np.maximum(0, 1 - LIMIT / np.maximum(sagitta, 1e-30)))


def poorness(jacobian: np.ndarray, aim: float) -> np.ndarray:
    """Cost of hexes by their scaled Jacobians (H,): 1 for a flat one, 0 from the aim on."""
    return (np.maximum(0, aim - jacobian) / aim) ** POWER


def edge_keys(ends: np.ndarray, n_vertices: int) -> np.ndarray:
    """(N,) one number for each edge (N, 2), whatever its direction."""
    return np.sort(ends, axis=1) @ np.array([n_vertices, 1])
