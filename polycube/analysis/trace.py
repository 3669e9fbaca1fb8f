"""Integrals over boundary faces of a spline solid."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix, diags

from polycube.spline.bernstein import gauss
from polycube.spline.boundary import grid, sampling
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


def trace(spline: Spline, faces: np.ndarray) -> Trace:
    """N_GAUSS^2 Gauss points on each of `spline.sides[faces]`."""
    t, w = gauss(N_GAUSS)
    u, v = (np.tile(each, len(faces)) for each in grid(t))
    at, du, dv = sampling(spline, u, v, np.repeat(faces, N_GAUSS**2))
    nodes = spline.extraction @ spline.control
    normal = np.cross(du @ nodes, dv @ nodes)
    length = np.linalg.norm(normal, axis=1)
    return Trace(
        shape=csr_matrix(at @ spline.extraction),
        points=at @ nodes,
        normals=normal / np.maximum(length, np.finfo(float).tiny)[:, None],
        area=length * np.tile(np.kron(w, w), len(faces)),
    )
