"""The space of all continuous piecewise tricubic functions on a hex mesh."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix, eye

from polycube.hexmesh.connectivity import part, split
from polycube.spline.spaces.extraction import TENSOR, OnHexes, bezier_nodes
from polycube.spline.spaces.subdivision import bezier_halves
from polycube.types import HexMesh


@dataclass(frozen=True, eq=False)
class ContinuousSpace(OnHexes):
    """The cubic finite elements of a hex mesh; implements `hierarchy.Space`."""

    points: np.ndarray  # (B, 3) Bezier points of the geometry

    @cached_property
    def nodes(self) -> np.ndarray:
        """(H, 64) Bezier nodes of each hex."""
        return bezier_nodes(self.mesh.hexes[:, TENSOR])[0]

    @property
    def extraction(self) -> csr_matrix:
        """(B, C) rows of all Bezier nodes."""
        return eye(len(self.points), format="csr")

    @property
    def control(self) -> np.ndarray:
        """(C, 3) coefficients of the geometry."""
        return self.points

    def finer(self, elements: np.ndarray) -> tuple[ContinuousSpace, csr_matrix]:
        """The space of the children of some hexes, 8 i to 8 i + 7, and the two-scale matrix."""
        mesh, halves = self.halved(elements)
        return ContinuousSpace(mesh, halves @ self.points), halves

    def halved(self, elements: np.ndarray) -> tuple[HexMesh, csr_matrix]:
        """Divide hexes into eight; the mesh, and the Bezier nodes (B', B) of the children."""
        mesh = split(part(self.mesh, elements, self.sides)[0])
        nodes = bezier_nodes(mesh.hexes[:, TENSOR])[0]
        wanted = np.arange(nodes.max() + 1)
        return mesh, bezier_halves(self.nodes[elements], nodes, wanted, len(self.points))
