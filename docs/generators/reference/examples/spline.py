from dataclasses import dataclass

import numpy as np

from polycube.registry import register
from polycube.types import HexMesh, Spline, TriMesh


@register("spline", "straight")
@dataclass(frozen=True)
class Straight:
    """Trilinear functions of the vertices: the Bezier points of a hex are between its corners."""

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> Spline:
        from scipy.sparse import csr_matrix

        from polycube.hexmesh.connectivity import PLACES, quad_sides
        from polycube.spline.spaces.extraction import TENSOR, bezier_nodes

        nodes, _ = bezier_nodes(hexes.hexes[:, TENSOR])
        share = np.stack(np.meshgrid(*[np.arange(4) / 3] * 3, indexing="ij"), -1)
        share = share.transpose(2, 1, 0, 3).reshape(64, 1, 3)
        weights = np.where(PLACES, share, 1 - share).prod(axis=2)  # (64, 8)
        node, first = np.unique(nodes, return_index=True)
        element, place = np.divmod(first, 64)
        row = np.repeat(node, 8)
        entries = weights[place].ravel(), (row, hexes.hexes[element].ravel())
        extraction = csr_matrix(entries, (len(node), len(hexes.vertices)))
        number = np.arange(len(hexes.hexes))
        sides = np.stack(quad_sides(hexes), axis=1)
        level = np.zeros_like(number)
        return Spline(hexes.vertices, extraction, nodes, number, level, sides, hexes.patch)
