"""Pairs as published: primitives as meshes of fixed vertices, with the same numbers on both shapes.

A cell is a mesh of 512 vertices of its primitive, and its geometry is the same mesh rounded by
smoothing, in the same box. Meshes of several cells stand beside each other. There is nothing random
in a pair: that vertex i of the geometry belongs to vertex i of the polycube is all a network learns
besides the noise of the diffusion.
"""

from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np

from polycube.diffusion.encoding import POINTS_PER_CELL
from polycube.diffusion.pairs.pairs import Pair
from polycube.diffusion.pairs.templates import Context, refined, rounded
from polycube.structure.lattice import boundary, cell_and_wall, lattice
from polycube.surface.measures import triangle_vectors, unit

PIECES = (3, 2)  # of the edge of a voxel: a full cell has 488 vertices, one with a hole 256


def cell_mesh(voxels: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mesh of a primitive in a cell of edge 1: vertices (512, 3), faces (F, 3), labels (512, 2).

    The voxels (3, 3, 3) are divided as finely as the number of vertices allows. Evenly chosen quads
    then get a vertex in their middle, and are divided into four triangles instead of two. The
    labels of a vertex are the axis of one of its faces, and 1 if this is the face of a hole.
    """
    solid = lattice((1, 1, 1), ("cell",), {"cell": voxels})
    for pieces in PIECES:
        fine = refined(solid, pieces)
        surface = boundary(fine)
        missing = POINTS_PER_CELL - len(surface.vertices)
        if 0 <= missing <= len(surface.quads):
            break
    else:
        raise ValueError(f"no mesh of {POINTS_PER_CELL} vertices for this primitive")
    quads = surface.quads
    chosen = np.linspace(0, len(quads), missing, endpoint=False).astype(int)
    middle = len(surface.vertices) + np.arange(missing)
    corners, others = quads[chosen], np.delete(quads, chosen, axis=0)
    fans = np.stack([corners, np.roll(corners, -1, axis=1), middle[:, None].repeat(4, 1)], axis=2)
    faces = np.concatenate([others[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3), fans.reshape(-1, 3)])
    vertices = np.vstack([surface.vertices, surface.vertices[corners].mean(axis=1)])
    of_quad = np.stack([surface.axis, cell_and_wall(fine, surface)[1]], axis=1)
    labels = np.empty((POINTS_PER_CELL, 2), np.int64)
    labels[quads], labels[middle] = of_quad[:, None], of_quad[chosen]
    return vertices, faces, labels


class MeshPairs:
    """Pairs of the given contexts, in turn; the pairs of a context are all equal.

    rounding : amount of smoothing, see `templates.rounded`
    """

    def __init__(
        self,
        grid: Sequence[int],
        primitives: Mapping[str, np.ndarray],
        contexts: Sequence[Context],
        rounding: float,
    ) -> None:
        self.grid, self.contexts = tuple(grid), list(contexts)
        self.primitives, self.rounding = primitives, rounding
        self._pair = cache(self._made)

    def __call__(self, index: int) -> Pair:
        """Pair number `index` >= 0, in the box of its cells."""
        return self._pair(self.contexts[index % len(self.contexts)])

    def _made(self, context: Context) -> Pair:
        rows = []
        for cell, name in enumerate(context):
            if name is not None:
                vertices, faces, labels = cell_mesh(self.primitives[name])
                corner = np.array(np.unravel_index(cell, self.grid)) - np.array(self.grid) / 2
                smooth = rounded(vertices, faces, self.rounding)
                normals = np.zeros_like(smooth)
                np.add.at(normals, faces, triangle_vectors(smooth[faces])[:, None])
                labels = np.insert(labels, 1, cell, axis=1)
                rows.append((smooth + corner, unit(normals), vertices + corner, labels))
        geometry, normals, polycube, labels = map(np.concatenate, zip(*rows, strict=True))
        return Pair(geometry, normals, polycube, labels, context)
