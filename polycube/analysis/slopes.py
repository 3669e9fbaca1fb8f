"""Edges next to constrained faces at which the functions of a spline space have zero slope."""

import numpy as np
from scipy.sparse import csr_matrix

from polycube.hexmesh.connectivity import unique_rows
from polycube.spline.boundary import boundary_nodes
from polycube.types import Spline

ZERO = 1e-12  # smaller coefficients count as zero


def zero_slope_edges(spline: Spline, faces: np.ndarray, basis: csr_matrix) -> tuple[int, int]:
    """Number of edges of constrained faces with zero slope on the other side, and of all edges.

    faces : (F,) indices of `spline.sides`
    basis : (C, free) functions that vanish there

    If the space is smooth at an edge, a function that vanishes on one side starts with zero slope
    on the other, which is an additional constraint. Edges between elements of different levels do
    not count.
    """
    nodes = boundary_nodes(spline).reshape(-1, 4, 4)
    turned = nodes.swapaxes(1, 2)
    lines = np.concatenate([nodes, nodes[:, ::-1], turned, turned[:, ::-1]])
    # lines : (4 Q, 4, 4) nodes in lines from each edge of each face
    edge = unique_rows(np.sort(lines[:, 0], axis=1))[1]
    is_constrained = np.isin(np.tile(np.arange(len(nodes)), 4), faces)
    is_border = (np.bincount(edge) == 2) & (np.bincount(edge, is_constrained) == 1)
    second = lines[~is_constrained & is_border[edge], 1, 1:3]
    slope = np.asarray(abs(spline.extraction[second.ravel()] @ basis).sum(axis=1))
    is_flat = np.all(slope.reshape(-1, 2) <= ZERO, axis=1)
    return int(is_flat.sum()), len(is_flat)
