"""Fields of the gradient of a solution, such as stress, as Bezier coefficients.

They are taken at 4^3 Gauss points of every element, where det J is known to be positive, carried to
its Bezier points by the tricubic polynomial through them, and averaged over the elements that share
a point: continuous wherever the geometry is.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_matrix

from polycube.spline.bernstein import bernstein, gauss, tensor, volume_basis
from polycube.spline.bezier import bezier_points
from polycube.types import Spline

CHUNK = 512  # elements at a time
EVEN = tensor(*[bernstein(np.arange(4) / 3)] * 3)


def gradient_field(
    spline: Spline, values: np.ndarray, of: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray:
    """(B, n) Bezier coefficients of a function of the gradient, averaged where elements meet.

    values : (C,) or (C, m) coefficients of the solution
    of : takes du_a/dx_i as (P, m, 3) and gives (P, n)
    """
    points = bezier_points(spline)
    local = (spline.extraction @ values.reshape(len(values), -1))[spline.nodes]
    _, gradients = volume_basis(gauss(4)[0])
    to_bezier = np.linalg.inv(tensor(*[bernstein(gauss(4)[0])] * 3))
    total = []
    for chunk in np.array_split(np.arange(len(points)), len(points) // CHUNK + 1):
        jacobian = np.einsum("aqm,emi->eqia", gradients, points[chunk], optimize=True)
        slope = np.einsum("aqm,emd->eqda", gradients, local[chunk], optimize=True)
        slope = slope @ np.linalg.inv(jacobian)  # (e, q, d, i)
        found = of(slope.reshape(-1, *slope.shape[2:])).reshape(len(chunk), 64, -1)
        total.append(to_bezier @ found)
    return _shared(spline, np.concatenate(total))


def field_of(spline: Spline, nodal: np.ndarray, of: Callable) -> np.ndarray:
    """(B,) Bezier coefficients of a function of a field, exact at the even places of `samples`.

    nodal : (B, n) Bezier coefficients of the field; of : takes (P, n) and gives (P,)
    """
    found = of(samples(spline, nodal).reshape(-1, nodal.shape[1])).reshape(-1, 64, 1)
    return _shared(spline, np.linalg.inv(EVEN) @ found)[:, 0]


def samples(spline: Spline, nodal: np.ndarray) -> np.ndarray:
    """(E, 64, n) values of a field (B, n) at 4^3 even places of each element, corners included."""
    return EVEN @ nodal[spline.nodes]


def _shared(spline: Spline, values: np.ndarray) -> np.ndarray:
    """(B, n) mean over the elements of each node; values (E, 64, n)."""
    nodes = spline.nodes.ravel()
    size = spline.extraction.shape[0]
    rows = (np.ones(len(nodes)), (nodes, np.arange(len(nodes))))
    count = np.bincount(nodes, minlength=size).clip(1)
    total = csr_matrix(rows, (size, len(nodes))) @ values.reshape(len(nodes), -1)
    return total / count[:, None]
