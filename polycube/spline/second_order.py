"""Hexes of 20 or 27 nodes: on the fitted spline if there is one, else with straight edges.

A hex of 27 nodes is a triquadratic map. A hex of 20 nodes is one as well, with the nodes of its
faces and its centre from the serendipity functions. det J has degree 5 in each of xi, eta, zeta;
its Bernstein coefficients are bounded as for trilinear hexes (`polycube.hexmesh.certificate`).
"""

import logging
from dataclasses import dataclass

import numpy as np

from polycube.hexmesh.certificate import ROUNDING, signed_bounds
from polycube.hexmesh.connectivity import EDGES, FACES, PLACES, quad_sides, unique_rows
from polycube.spline.bernstein import bernstein, derivative, tensor
from polycube.types import HexMesh, Spline

logger = logging.getLogger(__name__)

CHUNK = 250  # hexes in a batch

# ends of the edges in the order of their nodes, 8 to 19; the faces follow in that of FACES
EDGE_ENDS = np.reshape(
    [0, 1, 1, 2, 2, 3, 3, 0, 4, 5, 5, 6, 6, 7, 7, 4, 0, 4, 1, 5, 2, 6, 3, 7], (12, 2)
)


GROUPS = [*np.arange(8)[:, None], *EDGE_ENDS, *FACES, np.arange(8)]  # corners round the nodes
STRAIGHT = np.array([np.eye(8)[corners].mean(axis=0) for corners in GROUPS])  # (27, 8)
PARAMETERS = STRAIGHT @ PLACES  # (27, 3) parameters of the nodes, in the order of VTK


def _serendipity() -> np.ndarray:
    """(27, 20) all nodes of a hex from its corners and edges.

    The centre of a face is half the sum of its edges minus a quarter of the sum of its corners; the
    centre of the hex is a quarter of the sum of its edges minus a quarter of the sum of its
    corners.
    """
    on_face = STRAIGHT[20:26] > 0
    of_face = np.hstack([on_face / -4, on_face[:, EDGE_ENDS].all(axis=2) / 2])
    return np.vstack([np.eye(20), of_face, np.repeat([-0.25, 0.25], [8, 12])])


SERENDIPITY = _serendipity()

DEGREE = 5  # of det J
_LINE = (1 - np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)) / 2  # extrema of Chebyshev polynomials
TO_BERNSTEIN = tensor(*[np.linalg.inv(bernstein(_LINE, DEGREE))] * 3)  # from values on _LINE^3


def _gradients() -> np.ndarray:
    """(3, 216, 27) gradients of the nodal functions on the grid _LINE^3, xi fastest."""
    through = np.linalg.inv(bernstein(np.array([0, 0.5, 1]), 2))
    b, d = bernstein(_LINE, 2) @ through, derivative(_LINE, 2) @ through
    place = np.rint(2 * PARAMETERS).astype(int) @ [1, 3, 9]
    return np.stack([tensor(d, b, b), tensor(b, d, b), tensor(b, b, d)])[:, :, place]


GRADIENTS = _gradients()
BASIS = np.einsum("pi,pj,pk->pkji", *map(bernstein, PARAMETERS.T)).reshape(27, 64)  # tricubic
CORNER_NODES = PLACES @ [3, 12, 48]  # of Bezier elements, in the order of VTK

# node at corner q of octant o, at index 8 o + q, and the first such pair of each node
_PAIRS = (PLACES[:, None] + PLACES).reshape(64, 3) @ [1, 3, 9]
OF_PAIR = np.argsort(np.rint(2 * PARAMETERS).astype(int) @ [1, 3, 9])[_PAIRS]
FIRST = np.unique(OF_PAIR, return_index=True)[1]


@dataclass(frozen=True, eq=False)
class HexElements:
    """Hexes of 8, 20 or 27 nodes in the order of VTK: corners, edges, faces, centre.

    The corners have the numbers of the vertices of the mesh, and the quads those of its quads.
    """

    points: np.ndarray  # (N, 3)
    hexes: np.ndarray  # (H, 8, 20 or 27) indices of points
    quads: np.ndarray  # (Q, 4, 8 or 9) indices of points
    straightened: int = 0  # number of hexes on a spline with straight edges
    inverted: int = 0  # number of hexes that are not positive even with straight edges


def hex_elements(mesh: HexMesh, spline: Spline | None, nodes: int) -> HexElements:
    """The hexes of a mesh with 8, 20 or 27 nodes.

    Hexes of 8 nodes are the mesh itself. For 20 and 27, all nodes including the corners are points
    of the spline, or of the trilinear hexes without a spline. det J of every hex is certified
    positive: if it is not, the nodes between its corners are moved to straight edges, also for the
    neighbours. Hexes with elements of several levels are straight.
    """
    if nodes == 8:
        return HexElements(mesh.vertices, mesh.hexes, mesh.quads)
    numbers, quads = _numbered(mesh, nodes)
    points = np.zeros((numbers.max() + 1, 3))
    points[: len(mesh.vertices)] = mesh.vertices
    is_straight = np.ones(len(points), bool)
    straightened = np.zeros(len(numbers), bool)
    if spline is not None:
        on_spline, at = _sampled(spline)
        points[numbers[on_spline]] = at[:, :nodes]
        is_straight[numbers[on_spline]] = False
        straightened = ~np.isin(np.arange(len(numbers)), on_spline)
    straight = np.empty_like(points)
    straight[numbers] = STRAIGHT[:nodes] @ points[numbers[:, :8]]
    is_straight[numbers[:, :8]] = True
    points[is_straight] = straight[is_straight]
    is_positive = positive(points, numbers)
    while (bent := ~is_positive & ~is_straight[numbers].all(axis=1)).any():
        straightened |= bent
        moved = np.zeros(len(points), bool)
        moved[numbers[bent]] = True
        points[moved], is_straight[moved] = straight[moved], True
        touched = np.flatnonzero(moved[numbers].any(axis=1))
        is_positive[touched] = positive(points, numbers[touched])
    found = HexElements(points, numbers, quads, int(straightened.sum()), int((~is_positive).sum()))
    _log(found, spline)
    return found


def positive(points: np.ndarray, hexes: np.ndarray) -> np.ndarray:
    """(H,) whether det J of hexes (H, 20 or 27) is certainly positive everywhere."""
    chunks = np.array_split(hexes, len(hexes) // CHUNK + 1)
    return np.concatenate([_positive(points[chunk]) for chunk in chunks])


def _positive(nodes: np.ndarray) -> np.ndarray:
    nodes = nodes - nodes[:, :1]  # reduces rounding errors for a part far from the origin
    at = SERENDIPITY @ nodes if nodes.shape[1] == 20 else nodes
    boxes = np.linalg.det(np.einsum("aqn,hni->hqia", GRADIENTS, at, optimize=True)) @ TO_BERNSTEIN.T
    length = np.linalg.norm(at[:, EDGES[:, 1]] - at[:, EDGES[:, 0]], axis=2).max(axis=1)
    tiny = ROUNDING * np.maximum(length**3, np.finfo(float).tiny)
    _, bound = signed_bounds(boxes - tiny[:, None], DEGREE)
    return bound > 0


def _numbered(mesh: HexMesh, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of the hexes (H, nodes) and of the quads (Q, 8 or 9)."""
    n, n_hexes = len(mesh.vertices), len(mesh.hexes)
    ends, edge, _ = unique_rows(np.sort(mesh.hexes[:, EDGE_ENDS].reshape(-1, 2), axis=1))
    sides = np.sort(np.stack([mesh.quads, np.roll(mesh.quads, -1, axis=1)], axis=-1), axis=2)
    hexes = [mesh.hexes, n + edge.reshape(n_hexes, 12)]
    quads = [mesh.quads, n + np.searchsorted(ends @ [n, 1], sides @ [n, 1])]
    if nodes == 27:
        n += len(ends)
        corners, face, _ = unique_rows(np.sort(mesh.hexes[:, FACES].reshape(-1, 4), axis=1))
        faces = n + face.reshape(n_hexes, 6)
        hexes += [faces, (n + len(corners) + np.arange(n_hexes))[:, None]]
        quads.append(faces[quad_sides(mesh)][:, None])
    return np.hstack(hexes), np.hstack(quads)


def _sampled(spline: Spline) -> tuple[np.ndarray, np.ndarray]:
    """Hexes (K,) whose elements have one level, and the 27 points (K, 27, 3) of each."""
    points = spline.extraction @ spline.control
    order = np.argsort(spline.element_hex, kind="stable")
    hexes, at = [], []
    for level in np.unique(spline.level).tolist():
        own = order[spline.level[order] == level]
        is_complete = np.bincount(spline.element_hex[own]) == 8**level
        elements = own[is_complete[spline.element_hex[own]]].reshape(-1, 8**level)
        if level == 0:
            is_sure = np.ones(len(elements), bool)
            found = BASIS @ points[spline.nodes[elements[:, 0]]]
        else:
            octant, corner = np.indices((8, 8))
            # of the 8^level elements of a hex, the one at each corner of each octant
            at_corners = octant * 8 ** (level - 1) + corner * ((8 ** (level - 1) - 1) // 7)
            nodes = spline.nodes[elements[:, at_corners], CORNER_NODES]  # (K, 8, 8)
            ids = nodes.reshape(-1, 64)
            first = ids[:, FIRST]
            # whether the elements have the expected order
            is_sure = (first[:, OF_PAIR] == ids).all(axis=1)
            found = points[first]
        hexes.append(spline.element_hex[elements[is_sure, 0]])
        at.append(found[is_sure])
    return np.concatenate(hexes), np.concatenate(at)


def _log(found: HexElements, spline: Spline | None) -> None:
    nodes, n_hexes = found.hexes.shape[1], len(found.hexes)
    where = "with straight edges, because there is no spline" if spline is None else "on the spline"
    logger.info("%d hexes of %d nodes %s", n_hexes, nodes, where)
    if found.straightened:
        logger.warning(
            "warning: %s have straight edges, because det J > 0 is not certain with curved ones, "
            "or they contain spline elements of several levels",
            f"{found.straightened} of {n_hexes} hexes of {nodes} nodes",
        )
    if found.inverted:
        logger.warning("warning: %d hexes of %d nodes may be inverted", found.inverted, nodes)
