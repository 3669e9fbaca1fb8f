"""A fitted mesh with the constraints of its boundary; the cost and the energy of its hexes."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix

from polycube.fitting import energy
from polycube.fitting.creases.constraints import Matching, match, with_tolerances
from polycube.fitting.creases.paths import numbered, path_sides
from polycube.fitting.cures import losses
from polycube.fitting.energy import Terms
from polycube.fitting.flat_corners import corners_between
from polycube.fitting.problem import FitProblem
from polycube.fitting.snapping import goals_of
from polycube.fitting.springs import NO_SPRINGS, Springs
from polycube.hexmesh.certificate import certify
from polycube.hexmesh.connectivity import CHILDREN, GRID, PLACES, quad_edges, quad_sides
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.surface.fit_target import Target
from polycube.surface.measures import connected, half_edges
from polycube.types import HexMesh

OFF = 50.0  # cost of a diagonal of distance from the surface, beyond FREE_DISTANCE
FREE_DISTANCE = 2e-3  # distance from the surface, in diagonals, without cost
POWER = 4  # exponent in the cost of a hex: one bad hex counts more than many slightly poor ones
STRAYED = 100.0  # cost of a diagonal of distance from exact features, beyond the permitted distance
DOUBTFUL = 0.5  # scaled Jacobian below which det J may be negative inside a hex
CLEAR = 0.05  # det J, relative to its mean, above which a hex is not halved
NODES = GRID / 2  # (27, 3) parameters, zeta fastest
WEIGHTS = np.where(PLACES, NODES[:, None], 1 - NODES[:, None]).prod(axis=2)  # (27, 8) of corners


class Links:
    """Connectivity of a mesh, which stays the same while its vertices move.

    sides : hex (Q,) of each boundary quad, and its local face (Q,)
    """

    def __init__(self, mesh: HexMesh) -> None:
        self.hexes, self.sides, self._number = mesh.hexes, quad_sides(mesh), len(mesh.vertices)
        ends = np.arange(0, mesh.hexes.size + 1, 8)
        table = csr_matrix((np.ones(mesh.hexes.size, bool), mesh.hexes.ravel(), ends))
        self._at_vertex = table.T.tocsr()  # (V, H)

    def at(self, vertices: np.ndarray) -> np.ndarray:
        """Hexes with one of the vertices, ascending."""
        found = np.zeros(len(self.hexes), bool)
        found[self._at_vertex[vertices].indices] = True
        return np.flatnonzero(found)

    def vertices(self, hexes: np.ndarray) -> np.ndarray:
        """(V,) whether a vertex belongs to one of the hexes."""
        found = np.zeros(self._number, bool)
        found[self.hexes[hexes]] = True
        return found

    def around(self, vertices: np.ndarray, rings: int) -> np.ndarray:
        """Vertices and those of some rings of hexes around them, ascending."""
        for _ in range(rings):
            vertices = np.flatnonzero(self.vertices(self.at(vertices)))
        return vertices


@dataclass(frozen=True, eq=False)
class Fitted:
    """A mesh at unit scale close to its target."""

    mesh: HexMesh  # its `patch` is the number of each quad
    patch: np.ndarray  # (Q,) patches of the original mesh
    target: Target  # the surface
    # vertices on each curve, in order, by its number in `target.followed`
    paths: Mapping[int, np.ndarray]
    corners: np.ndarray  # (P,) vertices at corners of the surface
    corner_goals: np.ndarray  # (P, 3) positions of these corners
    cad_face: np.ndarray  # (Q,) CAD face of each quad; 0 if it is unknown
    gap: np.ndarray  # (V,) distances of boundary vertices from their goals
    strayed: np.ndarray  # (V,) distances from exact features, minus the permitted distance
    distance: np.ndarray  # (S,) distances of samples of the features from the mesh, as in `losses`
    links: Links  # connectivity of the mesh

    @cached_property
    def jacobian(self) -> np.ndarray:
        """(H,) scaled Jacobians, as in `certified_jacobian`."""
        return certified_jacobian(self.mesh.vertices, self.mesh.hexes)

    @cached_property
    def away(self) -> np.ndarray:
        """(2, F) distances of the features from the mesh, as in `losses.percentiles`."""
        return losses.percentiles(self.distance, losses.samples_of(self.target).feature)

    @cached_property
    def on_path(self) -> np.ndarray:
        """(N,) keys of the boundary edges on paths: (lower end) V + (higher end)."""
        ends = [
            path_sides(path, self.target.followed.creases[number].is_loop)
            for number, path in self.paths.items()
        ]
        return edge_keys(np.concatenate([np.zeros((0, 2), np.int64), *ends]), len(self.gap))

    @cached_property
    def part(self) -> np.ndarray:
        """(Q,) part of the boundary of each quad, enclosed by the paths of the curves."""
        sides, pair = quad_edges(self.mesh.quads)
        joined = ~np.isin(edge_keys(sides, len(self.gap)), self.on_path)
        return connected(pair[joined, 0], pair[joined, 1], len(self.mesh.quads))


def fitted(mesh: HexMesh, target: Target) -> Fitted:
    """Prepare a mesh in model units that is fitted to its target."""
    unit = replace(mesh, vertices=target.to_unit(mesh.vertices), patch=np.arange(len(mesh.quads)))
    problem = FitProblem(unit, target, samples=1)
    matching = with_tolerances(match(problem, unit.vertices), len(unit.vertices))
    paths = numbered(matching.routes, target.followed)
    boundary = matching.corner, matching.corner_goal, problem.cad_face
    off = distances(problem, unit.vertices, matching)
    distance = losses.distances(unit, losses.samples_of(target))
    return Fitted(unit, mesh.patch, target, paths, *boundary, *off, distance, Links(unit))


def distances(
    problem: FitProblem, x: np.ndarray, matching: Matching
) -> tuple[np.ndarray, np.ndarray]:
    """Distances (V,) from the goals, and from exact features (V,) minus the permitted distance."""
    at = goals_of(problem, x, matching, np.ones(len(x)))
    gap = np.linalg.norm(at.place(problem, x) - x, axis=1)
    strayed = np.zeros(len(x))
    on_feature = np.append(at.curve, at.corner)
    assert at.allowed is not None  # the matching is exact
    strayed[on_feature] = np.maximum(0, gap[on_feature] - at.allowed[on_feature])
    return gap, strayed


def cost(
    jacobian: np.ndarray, gap: np.ndarray, strayed: np.ndarray, aim: float
) -> tuple[float, float]:
    """Cost of hexes below the aim and of vertices away from the surface; smaller is better.

    gap : (V,) distances of vertices from their goals
    strayed : (V,) distances from exact features, minus the permitted distance

    Returns the total cost, and the smallest scaled Jacobian.
    """
    least = float(jacobian.min())
    poor = float(hex_costs(jacobian, aim).sum()) + 10 * (least <= 0)
    away = OFF * np.maximum(0, gap - FREE_DISTANCE) + STRAYED * strayed
    return poor + float(away.max(initial=0)), least


def hex_costs(jacobian: np.ndarray, aim: float) -> np.ndarray:
    """Cost of hexes by their scaled Jacobians (H,): 1 for a flat hex, 0 above the aim."""
    return (np.maximum(0, aim - jacobian) / aim) ** POWER


def edge_keys(ends: np.ndarray, n_vertices: int) -> np.ndarray:
    """(N,) one number for each undirected edge (N, 2)."""
    return np.sort(ends, axis=1) @ np.array([n_vertices, 1])


def with_flat_corners(fit: Fitted) -> Iterator[tuple[int, np.ndarray]]:
    """Numbers of CAD faces with flat corners, and hexes (H,) to surround by a sheet there."""
    mesh, owner = fit.mesh, fit.links.sides[0]
    on = np.isin(edge_keys(half_edges(mesh.quads), len(mesh.vertices)), fit.on_path).reshape(-1, 4)
    flat, sharp = corners_between(mesh.vertices, mesh.quads, on, on, fit.corners)
    for number in np.unique(fit.part[flat.any(axis=1)]):
        own = fit.part == number
        yield int(fit.cad_face[own][0]), np.isin(np.arange(len(mesh.hexes)), owner[own & ~sharp])


def certified_jacobian(vertices: np.ndarray, hexes: np.ndarray) -> np.ndarray:
    """(H,) scaled Jacobians, at most 0 where det J is not positive everywhere in the hex."""
    found = scaled_jacobian(vertices, hexes)
    doubtful = np.flatnonzero((found > 0) & (found < DOUBTFUL))
    found[doubtful[~certify(vertices, hexes[doubtful]).positive]] = 0.0
    return found


def halved_energy(
    x: np.ndarray, hexes: np.ndarray, lengths: np.ndarray, terms: Terms
) -> Callable[..., tuple[float, np.ndarray]]:
    """Function of positions (V, 3), and springs if any: the energy and its gradient (V, 3).

    The energy of a hex contains its eight corners and its centre, but det J can be negative
    elsewhere. So hexes that may be inverted inside are halved in each direction. The corners of the
    eight halves of a trilinear hex are at the 27 nodes of det J, which has degree 2 in each
    parameter.
    The arguments are those of `polycube.fitting.energy.energy`. Hexes whose det J is not clearly
    positive at x count twice: whole, and halved. The halves have no floor.
    """
    some = np.flatnonzero(scaled_jacobian(x, hexes) < DOUBTFUL)
    some = some[certify(x, hexes[some]).least < CLEAR]
    shape = 27 * len(some), len(x)
    row, column = np.repeat(np.arange(shape[0]), 8), np.repeat(hexes[some], 27, axis=0).ravel()
    nodes = csr_matrix((np.tile(WEIGHTS.ravel(), len(some)), (row, column)), shape=shape)
    halves = (27 * np.arange(len(some))[:, None, None] + CHILDREN).reshape(-1, 8)
    half = np.repeat(lengths[some] / 2, 8, axis=0)
    free = terms._replace(floor=-np.inf)

    def function(y: np.ndarray, springs: Springs = NO_SPRINGS) -> tuple[float, np.ndarray]:
        value, gradient = energy.energy(y, hexes, lengths, terms, springs)
        if not len(some):
            return value, gradient
        more, by_node = energy.energy(nodes @ y, halves, half, free, NO_SPRINGS)
        return value + more, gradient + nodes.T @ by_node

    return function
