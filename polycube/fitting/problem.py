"""A hex mesh whose vertices move over a target: sizes, normals, springs and descent.

The positions x (V, 3) are at the unit scale of the target and belong to the caller; a FitProblem
holds the data that do not change while they move. The matches of the last search are the initial
guesses of the next; they change the time, not the result.
"""

from functools import cached_property, partial

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, diags

from polycube.fitting import energy
from polycube.fitting.energy import Terms
from polycube.fitting.springs import Springs, together
from polycube.hexmesh.connectivity import EDGES, FACES, PLACES, edge_valence, neighbours, quad_edges
from polycube.hexmesh.quality import triangles
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.numerics.lbfgs import descend
from polycube.numerics.threads import parts, side_by_side
from polycube.surface import closest
from polycube.surface.fit_target import Target
from polycube.surface.measures import connected, unit
from polycube.types import HexMesh

# smoothing steps and isotropy of the wanted lengths, see `FitProblem.lengths`
RESHAPED = 3, 0.1  # while hexes take their shape
KEPT = 2, 0.05  # while the worst hexes are improved
SMALLEST = 0.3  # of the median: smallest size of a vertex
SHORTEST = 0.15  # of the median: smallest wanted length
TANGLED = 0.01  # smallest determinant below which the energy is regularized in proportion to it
SPREAD = 0.04  # square of the ratio of the regularization and the determinant


class FitProblem:
    """Connectivity of a hex mesh and the surface to which it is fitted.

    The mesh may be a part of another one; its quads are the boundary quads of that mesh.
    """

    def __init__(self, mesh: HexMesh, target: Target, samples: int) -> None:
        self.mesh, self.target = mesh, target
        self.hexes, self.quads = mesh.hexes, mesh.quads
        self.outer = np.unique(mesh.quads)  # (B,) boundary vertices
        self.sides, self.side_quads = quad_edges(mesh.quads, is_closed=False)
        self._at_vertex = _incidence(mesh.quads, len(mesh.vertices))  # (V, Q)
        sides = _incidence(self.sides, len(mesh.vertices))
        degree = sides @ np.ones(len(self.sides))
        self._side_mean = diags(1 / np.maximum(degree, 1)) @ sides  # (V, E)
        points, normals, cad_face = target.samples(samples)
        subset = slice(None, None, 1 + len(target.surface.vertices) // (2 * samples))
        corners = target.surface.vertices[subset]
        self.points = np.concatenate([points, corners])
        self.point_normals = np.concatenate([normals, target.vertex_normals[subset]])
        self.point_face = np.append(cad_face, np.zeros(len(corners), np.int64))
        self.cad_face = np.zeros(len(mesh.quads), np.int64)  # of the quads; 0: unknown
        self.vertex_face = np.zeros(len(self.outer), np.int64)  # the same for the outer vertices
        self._face = np.zeros(len(self.outer), np.int64)
        self._triangle = np.zeros(len(self.points), np.int64)
        self._tree: closest.Tree | None = None  # tree of the quads at their last positions
        # arguments of the last closest-point query, positions and normals (B, 6), and the results
        self._last: tuple[tuple[float, float], np.ndarray, np.ndarray] | None = None

    def restrict_to_faces(self, cad_face: np.ndarray) -> None:
        """Fit every quad (Q,) only to its own CAD face from now on; 0: to any."""
        self.cad_face = cad_face
        low, high = np.full(len(self.mesh.vertices), np.inf), np.full(len(self.mesh.vertices), -1.0)
        corner, own = self.quads.ravel(), np.repeat(cad_face, 4)
        np.minimum.at(low, corner, own)
        np.maximum.at(high, corner, own)
        self.vertex_face = np.where(low == high, low, 0)[self.outer].astype(np.int64)
        self._tree = self._last = None

    @cached_property
    def _direction_mean(self) -> csr_matrix:
        """(3H, 3H) mean over the same direction (3 hex + direction) in the neighbouring hexes."""
        hexes, (a, b) = self.hexes, neighbours(self.hexes)
        first, second = [3 * (a // 6) + a % 6 // 2], [3 * (b // 6) + b % 6 // 2]
        for k in range(2):  # the two directions in the common face
            one, two = FACES[a % 6, k], FACES[a % 6, k + 1]
            start, end = (
                (hexes[b // 6] == hexes[a // 6, corner][:, None]).argmax(axis=1)
                for corner in (one, two)
            )
            first.append(3 * (a // 6) + (PLACES[one] != PLACES[two]).argmax(axis=1))
            second.append(3 * (b // 6) + (PLACES[start] != PLACES[end]).argmax(axis=1))
        i, j = np.concatenate(first), np.concatenate(second)
        entries = (np.ones(2 * len(i)), (np.append(i, j), np.append(j, i)))
        graph = coo_matrix(entries, shape=(3 * len(hexes),) * 2).tocsr()
        degree = graph @ np.ones(3 * len(hexes))
        isolated = diags((degree == 0).astype(float))
        return (diags(1 / np.maximum(degree, 1)) @ graph + isolated).tocsr()

    @cached_property
    def side_valence(self) -> np.ndarray:
        """(E,) number of hexes at each side."""
        found, count = edge_valence(self.hexes)
        key = np.array([len(self.mesh.vertices), 1])
        return count[np.searchsorted(found @ key, self.sides @ key)]

    def normals(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Unit normals of the vertices (V, 3) and of the boundary quads (Q, 3)."""
        a, b, c, d = np.moveaxis(x[self.quads], 1, 0)
        by_quad = np.cross(c - a, d - b)
        return unit(self._at_vertex @ by_quad), unit(by_quad)

    def size(self, x: np.ndarray) -> np.ndarray:
        """(V,) mean length of the boundary edges at a vertex, at least SMALLEST of the median."""
        mean = self._side_mean @ np.linalg.norm(x[self.sides[:, 0]] - x[self.sides[:, 1]], axis=1)
        return np.maximum(mean, SMALLEST * np.median(mean[self.outer])) if len(self.outer) else mean

    def lengths(self, x: np.ndarray, smooth: int, isotropy: float) -> np.ndarray:
        """(H, 3) wanted edge lengths: the present means, smoothed over neighbours.

        smooth : number of smoothing steps of the logarithms
        isotropy : share of the mean of the three directions
        """
        ends = x[self.hexes[:, EDGES]]  # (H, 12, 2, 3), four edges in each direction
        edges = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2)
        length = edges.reshape(-1, 3, 4).mean(axis=2)
        log = np.log(np.maximum(length, SHORTEST * np.median(length))).ravel()
        for _ in range(smooth):
            log = 0.5 * log + 0.5 * (self._direction_mean @ log)
        log = log.reshape(-1, 3)
        return np.exp((1 - isotropy) * log + isotropy * log.mean(axis=1, keepdims=True))

    def scaled_jacobian(self, x: np.ndarray) -> np.ndarray:
        """(H,) scaled Jacobians, see `polycube.hexmesh.scaled_jacobian`."""
        cuts = parts(len(self.hexes), energy.LEAST)
        calls = [partial(scaled_jacobian, x, self.hexes[cut]) for cut in cuts]
        return np.concatenate(side_by_side(calls))

    def feet(
        self, x: np.ndarray, normals: np.ndarray, alpha: float, free: float = 0.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """Compatible closest points of the target for boundary vertices (B, 3), and its normals.

        Only points that have moved since the last query are updated.
        """
        query = np.hstack([x, normals])[self.outer]
        parameters = alpha, free
        if self._last is None or self._last[0] != parameters:
            foot, new = np.empty((len(query), 3)), np.arange(len(query))
        else:
            _, before, foot = self._last
            foot, new = foot.copy(), np.flatnonzero((query != before).any(axis=1))
        face = self._face.copy()
        foot[new], face[new] = self.target.closest(
            query[new, :3], query[new, 3:], alpha, face[new], free, self.vertex_face[new]
        )
        self._face, self._last = face, (parameters, query, foot)
        return foot, self.target.normals[face]

    def cover(
        self,
        x: np.ndarray,
        quad_normals: np.ndarray,
        alpha: float,
        weight: np.ndarray,
        slack: float,
    ) -> Springs:
        """Springs from points of the target to the closest compatible boundary quads.

        Points of a CAD face are matched with its own quads if it has any.

        weight : (V,) per square of the size; 0 for a point whose quad has an incompatible normal
        """
        corners, normals = triangles(x, self.quads), np.repeat(quad_normals, 4, axis=0)
        if self._tree is None:
            self._tree = closest.tree(corners, normals, np.repeat(self.cad_face, 4))
        else:
            self._tree = closest.moved(self._tree, corners, normals)
        wanted = np.where(np.isin(self.point_face, self.cad_face), self.point_face, 0)
        _, self._triangle, share = closest.closest(
            self._tree, self.points, self.point_normals, alpha, self._triangle, group=wanted
        )
        quad, corner = self._triangle // 4, self._triangle % 4
        weights = np.repeat(share[:, 2:] / 4, 4, axis=1)
        row = np.arange(len(quad))
        weights[row, corner] += share[:, 0]
        weights[row, (corner + 1) % 4] += share[:, 1]
        vertex = self.quads[quad]
        facing = np.einsum("nd,nd->n", quad_normals[quad], self.point_normals) > 0
        strength = len(self.outer) / len(self.points) * weight[vertex].min(axis=1) * facing
        strength /= self.size(x)[vertex].mean(axis=1) ** 2
        return Springs(vertex, weights, self.points, self.point_normals, strength, slack * strength)

    def relax(
        self,
        x: np.ndarray,
        lengths: np.ndarray,
        terms: Terms,
        springs: list[Springs],
        iterations: int,
        moves: np.ndarray | None = None,
    ) -> np.ndarray:
        """Lower the energy; if all hexes are valid, they stay valid.

        moves : (V,) vertices that may move; None: all
        """
        least = energy.least_determinant(x, self.hexes, lengths)
        is_tangled = least < TANGLED
        eps = min(np.sqrt(energy.EPS**2 + SPREAD * least**2), 1.0) if is_tangled else energy.EPS
        floor = energy.bound(least) if least > 0 else -np.inf
        terms, pulls = terms._replace(eps=eps, floor=floor), together(springs)
        free = 1.0 if moves is None else moves[:, None]

        def function(y: np.ndarray) -> tuple[float, np.ndarray]:
            value, gradient = energy.energy(y, self.hexes, lengths, terms, pulls)
            return value, gradient * free

        return descend(function, x, iterations)

    def parts(self, joined: np.ndarray) -> np.ndarray:
        """(Q,) connected part of the boundary of each quad, across the sides `joined` (E,)."""
        first, second = self.side_quads[joined].T
        return connected(first, second, len(self.quads))

    def touching(self, is_bad: np.ndarray) -> np.ndarray:
        """(V,) whether a vertex belongs to one of the bad hexes (H,)."""
        touched = np.zeros(len(self.mesh.vertices), bool)
        touched[self.hexes[is_bad]] = True
        return touched


def _incidence(cells: np.ndarray, n: int) -> csr_matrix:
    """(V, C) matrix of ones for the cells of each vertex."""
    column = np.repeat(np.arange(len(cells)), cells.shape[1])
    return csr_matrix((np.ones(cells.size), (cells.ravel(), column)), shape=(n, len(cells)))
