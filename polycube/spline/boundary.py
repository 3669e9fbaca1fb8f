"""The boundary of a spline solid: bicubic Bezier faces seen from outside, as sparse matrices.

Distances from the surface are measured in both directions.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np
from scipy.sparse import csr_matrix

from polycube.hexmesh.quality import Distances
from polycube.spline.bernstein import bernstein, derivative, gauss
from polycube.spline.bezier import min_detj
from polycube.surface import closest
from polycube.surface.fit_target import ALPHA, FREE, target
from polycube.surface.measures import unit
from polycube.types import Spline, TriMesh

_GRID = np.arange(64).reshape(4, 4, 4)  # [k, j, i]
# (6, 16) nodes of -xi +xi -eta +eta -zeta +zeta, seen from outside, first parameter fastest
FACES = np.stack(
    [
        _GRID[:, :, 0].T.ravel(),
        _GRID[:, :, 3].ravel(),
        _GRID[:, 0, :].ravel(),
        _GRID[:, 3, :].T.ravel(),
        _GRID[0].T.ravel(),
        _GRID[3].ravel(),
    ]
)
_CORNERS = [0, 3, 12, 15]
PIECES = 4  # divisions of a boundary face in each direction
SAMPLES = 8000  # points on the surface, in addition to its vertices
N_GAUSS = 5  # per direction: exact for bicubic traces times normals


class Elements(Protocol):
    """Bezier elements with faces on the boundary: a spline, or a spline space."""

    @property
    def extraction(self) -> csr_matrix:
        """(B, C) Bezier nodes from control points; each row has the sum 1."""

    @property
    def nodes(self) -> np.ndarray:
        """(E, 64) Bezier nodes of each element."""

    @property
    def sides(self) -> np.ndarray:
        """(Q, 2) element and local face of each face on the boundary."""


def boundary_nodes(spline: Elements) -> np.ndarray:
    """(Q, 16) Bezier nodes of the boundary faces, u fastest; d/du x d/dv points outwards."""
    element, side = spline.sides.T
    return spline.nodes[element[:, None], FACES[side]]


def corner_nodes(spline: Elements) -> np.ndarray:
    """(Q, 4) Bezier nodes at the corners of the boundary faces, counter-clockwise from outside."""
    return boundary_nodes(spline)[:, [0, 3, 15, 12]]


def edge_strips(spline: Spline) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges between two faces of the boundary of the same level.

    Returns nodes (4 Q, 2, 4) along the edges of all faces and along the rows beside them, and the
    numbers (N,) and (N,) of the two edges of faces that meet; edge n is on face n // 4.
    """
    nodes = boundary_nodes(spline).reshape(-1, 4, 4)
    sides = [nodes, nodes.swapaxes(1, 2)[:, ::-1], nodes[:, ::-1, ::-1]]
    sides.append(sides[1][:, ::-1, ::-1])
    strips = np.stack([side[:, :2] for side in sides], axis=1).reshape(-1, 2, 4)
    ends = np.sort(spline.places[strips[:, 0, [0, 3]]], axis=1)
    order = np.lexsort(ends.T)
    same = np.flatnonzero((ends[order][1:] == ends[order][:-1]).all(axis=1))
    return strips, order[same], order[same + 1]


def sampling(
    spline: Elements, u: np.ndarray, v: np.ndarray, faces: np.ndarray | None = None
) -> tuple[csr_matrix, csr_matrix, csr_matrix]:
    """Points, d/du and d/dv as matrices (n, B) on the Bezier nodes.

    faces : (n,) the face of each point (u, v) of (n,); without it, all points on every face, face
        by face
    """
    nodes = boundary_nodes(spline)
    tables = [bernstein(u), derivative(u)], [bernstein(v), derivative(v)]
    pairs = ((tables[0][a], tables[1][b]) for a, b in ((0, 0), (1, 0), (0, 1)))
    weights = [np.einsum("ni,nj->nji", x, y).reshape(-1, 16) for x, y in pairs]
    if faces is None:
        weights = [np.tile(w, (len(nodes), 1)) for w in weights]
        faces = np.repeat(np.arange(len(nodes)), len(u))
    columns = nodes[faces].ravel()
    ends = np.arange(0, len(columns) + 1, 16)
    shape = (len(faces), spline.extraction.shape[0])
    return tuple(csr_matrix((w.ravel(), columns, ends), shape) for w in weights)


def normals(du: np.ndarray, dv: np.ndarray) -> np.ndarray:
    """(n, 3) unit normals of tangents (n, 3); zero if these are parallel."""
    return unit(np.cross(du, dv))


def triangles(points: np.ndarray, pieces: int) -> np.ndarray:
    """(2 pieces^2 Q, 3, 3) triangles of the points ((pieces + 1)^2 Q, 3) of a grid on each face."""
    return points.reshape(-1, (pieces + 1) ** 2, 3)[:, _cut(pieces)].reshape(-1, 3, 3)


def corners(pieces: int) -> np.ndarray:
    """(2 pieces^2, 3, 2) u and v of the corners of the triangles of a face."""
    return np.stack(grid(np.arange(pieces + 1) / pieces), axis=1)[_cut(pieces)]


def _cut(pieces: int) -> np.ndarray:
    """(2 pieces^2, 3) indices of the points of the triangles of a face."""
    number = np.arange((pieces + 1) ** 2).reshape(pieces + 1, pieces + 1)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    return np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])


def grid(line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """u and v (n^2,) of a square grid, u fastest."""
    u, v = np.meshgrid(line, line)
    return u.ravel(), v.ravel()


def unshared_faces(nodes: np.ndarray) -> np.ndarray:
    """(Q, 2) element and local face of faces that no other element shares; nodes (E, 64)."""
    corners = np.sort(nodes[:, FACES[:, _CORNERS]].reshape(-1, 4), axis=1)
    _, inverse, count = np.unique(corners, axis=0, return_inverse=True, return_counts=True)
    return np.stack(np.divmod(np.flatnonzero(count[inverse.ravel()] == 1), 6), axis=1)


def distances(spline: Spline, surface: TriMesh) -> tuple[np.ndarray, np.ndarray]:
    """How far the part is outside the boundary, and how much it is inclined to it.

    Returns (Q, N_GAUSS^2) signed distances at the Gauss points of each face, in the units of the
    part, and the largest angles (Q,) between the normals there, in radians; 0 without CAD faces.
    """
    goal = target(surface)
    at, du, dv = sampling(spline, *grid(gauss(N_GAUSS)[0]))
    nodes = goal.to_unit(spline.extraction @ spline.control)
    points, facing = at @ nodes, normals(du @ nodes, dv @ nodes)
    foot, normal = goal.smooth(*goal.closest(points, facing, ALPHA, None, FREE))
    offset = ((foot - points) * facing).sum(axis=1) * goal.scale
    angle = np.arccos(np.clip((normal * facing).sum(axis=1), -1, 1)) * bool(len(surface.region))
    return offset.reshape(-1, N_GAUSS**2), angle.reshape(-1, N_GAUSS**2).max(axis=1)


@dataclass(frozen=True)
class Deviation:
    """Distances as fractions of the diagonal of the surface."""

    to_surface: Distances  # from points of the boundary of the spline
    to_spline: Distances  # from points of the surface
    worst: tuple[float, float, float]  # point with the largest distance, on either
    volume: float  # volume of the spline divided by that of the smooth surface, minus 1


@lru_cache(maxsize=4)
def deviation(spline: Spline, surface: TriMesh) -> Deviation:
    """Deviation at 25 points of each boundary face, and at samples and vertices of the surface.

    Distances of the latter are measured to chords of the spline, whose error is a 16th of the
    sagitta of a face. The result is cached for the plugin and the report.
    """
    goal = target(surface)
    points, _, _ = sampling(spline, *grid(np.arange(PIECES + 1) / PIECES))
    own = goal.to_unit(points @ (spline.extraction @ spline.control))
    there = np.linalg.norm(goal.smooth(*goal.closest(own))[0] - own, axis=1)
    flat = goal.closest(goal.samples(SAMPLES)[0])
    others = np.concatenate([goal.smooth(*flat)[0], goal.surface.vertices])
    here = closest.distance(closest.tree(triangles(own, PIECES)), others)
    both, places = np.concatenate([there, here]), np.concatenate([own, others])
    return Deviation(
        Distances.of(there),
        Distances.of(here),
        tuple(goal.to_model(places[both.argmax()]).tolist()),
        min_detj(spline).volume / goal.volume - 1,
    )
