"""The trilinear hexes on the vertices of a spline with one function for each vertex.

The value of the spline at a vertex is a mean of the coefficients around it, v = B c. The trilinear
function of these values is close to the spline, and so is its energy, also for the shortest waves.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.sparse import csr_matrix

from polycube.analysis.assembly import Elements
from polycube.types import ElementFunctions, Spline

CORNERS = np.array([0, 3, 12, 15, 48, 51, 60, 63])  # of the 4^3 Bezier points of an element
LEAST = 1 / 27  # smallest eigenvalue of B (largest 1): means of eight with weights 2/3 and 1/3
N_GAUSS = 2  # points per direction


@dataclass(frozen=True, eq=False)
class VertexModel:
    """Trilinear hexes; vertices are numbered like the functions."""

    values: csr_matrix  # (C, C) B
    corners: np.ndarray  # (E, 8) vertices of each element
    vertices: np.ndarray  # (C, 3)

    @classmethod
    def of(cls, spline: Spline) -> VertexModel | None:
        """The model of a spline, or None if its functions do not belong to vertices."""
        used, corners = np.unique(spline.nodes[:, CORNERS], return_inverse=True)
        if len(used) != len(spline.control) or spline.level.any():
            return None
        rows = csr_matrix(spline.extraction[used])
        function = np.asarray(rows.argmax(axis=1)).ravel()
        if len(np.unique(function)) != len(function):
            return None
        values = csr_matrix(rows[np.argsort(function)])
        return cls(values, function[corners].reshape(-1, 8), values @ spline.control)

    @property
    def elements(self) -> Elements:
        """The hexes as Bezier elements."""
        hats = _hats()
        order = np.argsort(self.corners, axis=1)
        functions = np.take_along_axis(self.corners, order, axis=1)
        n, at = len(functions), np.nonzero(hats)[1].reshape(8, -1)
        value = np.take_along_axis(hats, at, axis=1)
        starts = np.arange(8 * n + 1) * at.shape[1]
        matrix = csr_matrix((value[order].ravel(), at[order].ravel(), starts), (8 * n, 64))
        points = np.einsum("cm,eci->emi", hats, self.vertices[self.corners], optimize=True)
        return Elements(
            ElementFunctions(np.arange(n + 1) * 8, functions.ravel(), matrix),
            points.reshape(-1, 3),
            np.arange(64 * n).reshape(n, 64),
            len(self.vertices),
        )


def _hats() -> np.ndarray:
    """(8, 64) Bezier coefficients of the trilinear functions of the corners."""
    line = np.array([[3, 2, 1, 0], [0, 1, 2, 3]]) / 3
    return np.stack(
        [np.kron(line[z], np.kron(line[y], line[x])) for z, y, x in product((0, 1), repeat=3)]
    )
