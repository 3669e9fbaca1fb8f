"""Sets of hexes behind one corner of a boundary quad, bounded by layers of faces.

The two faces below the quad at its corner are continued straight across every regular edge until
the boundary or an irregular edge. If they divide the mesh, the hexes on the side of the quad form a
quadrant. A sheet around it adds a row of quads beside each of the two edges of the corner, and none
beside the other edges of the face.
"""

import numpy as np

from polycube.hexmesh.connectivity import EDGES, FACES, neighbours, unique_rows
from polycube.surface.measures import connected
from polycube.types import HexMesh

_FACES_OF_EDGE = np.array([[f for f in range(6) if np.isin(e, FACES[f]).all()] for e in EDGES])


def quadrant(mesh: HexMesh, hex_: int, face: int, corner: int) -> np.ndarray | None:
    """(H,) hexes behind a corner of a boundary quad; None if its faces do not divide the mesh.

    hex_, face : the boundary quad, as a hex and a local face
    corner : vertex of the quad
    """
    faces, number, count = unique_rows(np.sort(mesh.hexes[:, FACES].reshape(-1, 4), axis=1))
    own = number.reshape(-1, 6)[hex_]
    under = np.array([f for f in own if corner in faces[f] and f != own[face]])
    layer = connected(*_opposite(mesh.hexes, number, count), len(faces))
    is_layer = np.isin(layer, layer[under])
    sides, twins = neighbours(mesh.hexes)
    one, two, between = sides // 6, twins // 6, is_layer[number[sides]]
    part = connected(one[~between], two[~between], len(mesh.hexes))
    inside = part == part[hex_]
    beyond = np.isin(number[sides], under) & (inside[one] != inside[two])
    return inside if beyond.sum() == len(under) else None


def _opposite(
    hexes: np.ndarray, number: np.ndarray, count: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of faces that are opposite at an edge, as in a lattice; none at an irregular edge.

    number : (6 H,) face of each side of a hex; count : (F,) number of hexes of each face
    """
    _, edge, valence = unique_rows(np.sort(hexes[:, EDGES].reshape(-1, 2), axis=1))
    order = np.argsort(edge, kind="stable")
    pairs = number.reshape(-1, 6)[:, _FACES_OF_EDGE].reshape(-1, 2)[order]
    first, second = [], []
    for n_hexes, n_exposed in ((2, 2), (3, 2), (4, 0)):
        ring = pairs[valence[edge[order]] == n_hexes].reshape(-1, n_hexes, 2)
        is_exposed = count[ring] == 1
        regular = is_exposed.sum(axis=(1, 2)) == n_exposed
        ring, is_exposed = ring[regular], is_exposed[regular]
        if n_hexes == 2:
            both = ring[is_exposed].reshape(-1, 2).T
            first.append(both[0])
            second.append(both[1])
            continue
        inner = (~is_exposed).all(axis=2).argmax(axis=1)  # a hex with both faces inside
        total = (ring.sum(axis=(1, 2)) + (ring * is_exposed).sum(axis=(1, 2))) // 2
        for one in ring[np.arange(len(ring)), inner].T:
            is_own = (ring == one[:, None, None]).any(axis=2)
            adjacent = ((ring.sum(axis=2) - one[:, None]) * is_own).sum(axis=1)
            first.append(one)
            second.append(total - one - adjacent)
    return np.concatenate(first), np.concatenate(second)
