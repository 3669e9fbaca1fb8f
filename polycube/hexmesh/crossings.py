"""Self-intersections of the boundary of a hex mesh.

A boundary quad is a bilinear patch. It is replaced by two triangles, split along the diagonal from
the first corner of the face in the order of faces of Abaqus (S1 to S6), as in programs that
triangulate the boundary of a hex mesh. Triangles that touch, or overlap in one plane, count as
crossing.
"""

import numpy as np

from polycube.hexmesh.connectivity import FACES, quad_sides
from polycube.surface.intersections import meeting
from polycube.types import HexMesh

# the faces 3-0-4-7 and 2-3-7-6 of `connectivity.FACES` start next to the first corner of Abaqus
_OTHER_DIAGONAL = np.array([True, False, False, True, False, False])
# number of crossing pairs of quads above which later stages are not expected to separate them
MOST_CROSSINGS = 20


def crossings(mesh: HexMesh) -> np.ndarray:
    """Pairs (N, 2) i < j of boundary quads that cross or touch each other, in lexical order.

    Triangles with a common vertex do not count, so neighbouring quads are found only if they fold
    over each other elsewhere.
    """
    triangles, quad = _split(mesh)
    return np.unique(np.sort(quad[meeting(mesh.vertices, triangles, 0)], axis=1), axis=0)


def _split(mesh: HexMesh) -> tuple[np.ndarray, np.ndarray]:
    """Two triangles of each quad (2 Q, 3), and the quad of each triangle (2 Q,)."""
    hexa, face = quad_sides(mesh)
    quads = mesh.hexes[hexa[:, None], FACES[face]]
    quads = np.where(_OTHER_DIAGONAL[face, None], np.roll(quads, -1, axis=1), quads)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return triangles, np.tile(np.arange(len(quads)), 2)
