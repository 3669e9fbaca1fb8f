"""Nodal forces of forces on element faces: integrals of the nodal functions."""

from itertools import product
from typing import NamedTuple

import numpy as np

# corners, edges and centre of a face, each the mean of some corners, in [-1, 1]^2
CORNERS = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
PLACES = np.vstack([CORNERS, (CORNERS + np.roll(CORNERS, -1, axis=0)) / 2, [[0, 0]]])
ALL = [(i, j) for i in range(3) for j in range(3)]
# exponents of x and y, by number of nodes
POWERS = {4: [(0, 0), (1, 0), (0, 1), (1, 1)], 8: ALL[:-1], 9: ALL}
DERIVATIVES = ((0, 0), (1, 0), (0, 1))
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(4)


class AtGaussPoints(NamedTuple):
    """Values at G Gauss points of Q faces."""

    values: np.ndarray  # (G, n) of the nodal functions
    points: np.ndarray  # (Q, G, 3)
    normals: np.ndarray  # (Q, G, 3) of length 1
    areas: np.ndarray  # (Q, G)


def shares(faces: np.ndarray) -> np.ndarray:
    """Integrals (Q, n) of the nodal functions over faces (Q, n, 3) of 4, 8 or 9 nodes.

    The sum over a face is its area.
    """
    here = at_gauss_points(faces)
    return here.areas @ here.values


def at_gauss_points(faces: np.ndarray) -> AtGaussPoints:
    """The Gauss points of faces (Q, n, 3) of 4, 8 or 9 nodes."""
    n = faces.shape[1]
    grid = np.array(list(product(POINTS, repeat=2)))
    weights = np.prod(list(product(WEIGHTS, repeat=2)), axis=1)
    through = np.linalg.inv(_monomials(PLACES[:n], POWERS[n], 0, 0))
    values, along, across = (_monomials(grid, POWERS[n], *d) @ through for d in DERIVATIVES)
    normals = np.cross(along @ faces, across @ faces)
    lengths = np.linalg.norm(normals, axis=2)
    units = normals / np.maximum(lengths, np.finfo(float).tiny)[..., None]
    return AtGaussPoints(values, values @ faces, units, lengths * weights)


def _monomials(at: np.ndarray, powers: list[tuple[int, int]], dx: int, dy: int) -> np.ndarray:
    """(P, n) x^i y^j at points (P, 2), or the derivative by x or y."""
    columns = []
    for i, j in powers:
        column = at[:, 0] ** max(i - dx, 0) * at[:, 1] ** max(j - dy, 0)
        columns.append(column * (i if dx else 1) * (j if dy else 1))
    return np.stack(columns, axis=1)
