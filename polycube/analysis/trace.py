"""Integrals over boundary faces of a spline solid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix, diags

from polycube.spline.bernstein import bernstein, derivative, gauss
from polycube.spline.element_faces import FACES
from polycube.types import Spline

N_GAUSS = 5  # per direction: exact for bicubic traces times normals


@dataclass(frozen=True, eq=False)
class Trace:
    """Values of the spline functions at Gauss points on some boundary faces."""

    shape: csr_matrix  # (P, C)
    points: np.ndarray  # (P, 3)
    normals: np.ndarray  # (P, 3) outward, length 1
    area: np.ndarray  # (P,) area of each point

    @property
    def gram(self) -> csr_matrix:
        """(C, C) integrals of N_a N_b."""
        return csr_matrix(self.shape.T @ diags(self.area) @ self.shape)

    def moments(self, density: np.ndarray) -> np.ndarray:
        """(C,) or (C, n) integrals of N_a times a density (P,) or (P, n) at the points."""
        density = np.asarray(density)
        area = self.area.reshape(-1, *[1] * (density.ndim - 1))
        return self.shape.T @ (area * density)


def trace(spline: Spline, faces: np.ndarray, n_gauss: int = N_GAUSS) -> Trace:
    """n_gauss^2 Gauss points on each of `spline.sides[faces]`."""
    element, side = spline.sides[faces].T
    nodes = spline.nodes[element[:, None], FACES[side]]  # (F, 16), first parameter fastest
    t, w = gauss(n_gauss)
    b, d = bernstein(t), derivative(t)
    values, across, along = np.kron(b, b), np.kron(b, d), np.kron(d, b)  # (q, 16)
    columns = np.broadcast_to(nodes[:, None], (len(nodes), *values.shape))
    weights = np.broadcast_to(values, columns.shape).ravel()
    indptr = np.arange(0, columns.size + 1, 16)
    size = (len(indptr) - 1, spline.extraction.shape[0])
    at = csr_matrix((weights, columns.ravel(), indptr), size)
    corners = (spline.extraction @ spline.control)[nodes]
    normal = np.cross(across @ corners, along @ corners).reshape(-1, 3)
    length = np.linalg.norm(normal, axis=1)
    return Trace(
        shape=csr_matrix(at @ spline.extraction),
        points=(values @ corners).reshape(-1, 3),
        normals=normal / np.maximum(length, np.finfo(float).tiny)[:, None],
        area=length * np.tile(np.kron(w, w), len(nodes)),
    )
