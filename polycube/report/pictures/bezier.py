"""Boundary of a Bezier solid as small quads, for pictures of a spline."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from polycube.spline.boundary import grid, sampling
from polycube.types import Spline


@dataclass(frozen=True, eq=False)
class Skin:
    """Small quads on the boundary; `points @ values` evaluates values of the Bezier nodes."""

    points: csr_matrix  # (P, B) weight of each Bezier node at each point
    quads: np.ndarray  # (Q, 4) indices of points, counter-clockwise from outside
    edges: np.ndarray  # (L, 2) indices of points: parts of the edges of the elements


def tessellate(spline: Spline, pieces: int = 4) -> Skin:
    """Boundary faces of the elements, each divided into pieces * pieces quads."""
    n = pieces + 1
    points = sampling(spline, *grid(np.arange(n) / pieces))[0]
    rows = np.arange(len(spline.sides) * n * n).reshape(-1, n * n)
    local = np.arange(n * n).reshape(n, n)
    corners = [local[:-1, :-1], local[:-1, 1:], local[1:, 1:], local[1:, :-1]]
    quads = rows[:, np.stack([c.ravel() for c in corners], 1)].reshape(-1, 4)
    rim = np.concatenate([local[0], local[1:, -1], local[-1, -2::-1], local[-2::-1, 0]])
    edges = rows[:, np.stack([rim[:-1], rim[1:]], 1)].reshape(-1, 2)
    return Skin(points, quads, edges)
