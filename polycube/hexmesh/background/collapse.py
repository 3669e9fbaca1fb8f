"""Collapse the columns of hexes along convex edges of a mesh."""

import numpy as np

from polycube.hexmesh.connectivity import EDGES, hex_mesh
from polycube.surface.measures import connected
from polycube.types import HexMesh


def _others(edge: np.ndarray, end: int) -> list[int]:
    return [k for k in EDGES[(EDGES == end).any(axis=1)].ravel().tolist() if k not in edge]


# (12, 2, 2) the two other neighbours of each end of a local edge
BESIDE = np.array([[_others(edge, end) for end in edge] for edge in EDGES])


def collapsed(mesh: HexMesh, ends: np.ndarray, is_fixed: np.ndarray) -> HexMesh:
    """A mesh without the hexes at some edges; the two vertices beside each end become one there.

    Where one hex was at an edge, two hexes meet then, as in a disc of three blocks a quarter.
    Connected edges are left as they are if one of them has more than one hex, if a hex has more
    than one of them, or if a vertex beside them is fixed.

    Parameters
    ----------
    ends : (E, 2) vertices of boundary edges
    is_fixed : (V,) whether a vertex cannot become one with another
    """
    size = len(mesh.vertices)
    line = connected(ends[:, 0], ends[:, 1], size)
    keys = np.sort(ends, axis=1) @ [size, 1]
    at, edge = np.nonzero(np.isin(np.sort(mesh.hexes[:, EDGES], axis=2) @ [size, 1], keys))
    corner = mesh.hexes[at[:, None], EDGES[edge]]  # (N, 2)
    beside = mesh.hexes[at[:, None, None], BESIDE[edge]]  # (N, 2, 2)
    own = np.sort(corner, axis=1) @ [size, 1]
    bad = is_fixed[beside].any(axis=(1, 2))
    for each in (at, own):
        _, place, count = np.unique(each, return_inverse=True, return_counts=True)
        bad |= count[place] > 1
    good = ~np.isin(line[corner[:, 0]], line[corner[bad, 0]])
    one, two = beside[good].reshape(-1, 2).T
    name = connected(one, two, size)
    vertices = mesh.vertices.copy()
    vertices[one] = vertices[two] = vertices[corner[good].ravel()]
    places = np.empty((name.max() + 1, 3))
    places[name] = vertices
    used, hexes = np.unique(name[np.delete(mesh.hexes, at[good], axis=0)], return_inverse=True)
    return hex_mesh(places[used], hexes.reshape(-1, 8))
