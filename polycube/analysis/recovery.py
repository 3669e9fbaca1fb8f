"""Fields of the gradient of a solution, such as stress, as Bezier coefficients.

The gradient of a tricubic solution is most accurate at the 3^3 Gauss points of every element
(Barlow 1976). The values there are extrapolated to the Bezier points by a triquadratic polynomial
and averaged over the elements that share a node, so the field is continuous where these do. The
elements of different solids share none: stresses jump where the material changes.
"""

from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_matrix

from polycube.spline.bernstein import bernstein, gauss, tensor, volume_basis
from polycube.spline.bezier import bezier_points
from polycube.types import Spline

CHUNK = 512  # elements in a batch
ALMOST_NONE = 1e-12  # weight of a value that is used only if there is no other
EVEN_LINE = np.arange(4) / 3
EVEN = tensor(*[bernstein(EVEN_LINE)] * 3)
TO_BEZIER, TO_BEZIER_1D = np.linalg.inv(EVEN), np.linalg.inv(bernstein(EVEN_LINE))
BARLOW = gauss(3)[0]
_QUADRATIC = bernstein(EVEN_LINE, 2) @ np.linalg.inv(bernstein(BARLOW, 2))
CARRY = TO_BEZIER @ tensor(*[_QUADRATIC] * 3)  # (64, 27)

# factor of the estimated error of displacements and temperatures: that of the work of the loads is
# the square of the error of the stress, or the flux, in the energy norm
SAFETY = 2.0
TINY = np.finfo(float).tiny

OfField = Callable[[np.ndarray], np.ndarray]
OfGradient = Callable[[np.ndarray, np.ndarray], np.ndarray]  # of gradients and elements


def gradient_field(
    spline: Spline, nodal: np.ndarray, of: OfGradient, poor: np.ndarray | None = None
) -> np.ndarray:
    """(B, n) Bezier coefficients of a function of the gradient, averaged where elements meet.

    nodal : (B,) or (B, m) Bezier coefficients of the solution
    of : function of du_a/dx_i (e, q, m, 3) on elements (e,) -> (e, q, n)
    poor : (E,) elements that are used only at points without other elements
    """
    values = CARRY @ at_places(spline, nodal, of, BARLOW)
    return _shared(spline, values, poor)


def at_places(
    spline: Spline,
    nodal: np.ndarray,
    of: OfGradient,
    line: np.ndarray,
    elements: np.ndarray | None = None,
) -> np.ndarray:
    """(E, p^3, n) a function of the gradient, element by element, as in `gradient_field`.

    line : (p,) points in each direction
    elements : (E,) numbers, by default of all elements
    """
    elements = np.arange(len(spline.nodes)) if elements is None else elements
    points, local = bezier_points(spline), nodal.reshape(len(nodal), -1)[spline.nodes]
    _, gradients = volume_basis(line)
    found = []
    for chunk in np.array_split(elements, len(elements) // CHUNK + 1):
        slope = jacobians(local[chunk], gradients)
        slope = slope @ inverse(jacobians(points[chunk], gradients))  # (e, q, d, i)
        found.append(of(slope, chunk))
    return np.concatenate(found)


def volumes(points: np.ndarray, n_gauss: int) -> np.ndarray:
    """(E, q) volume of each Gauss point of elements (E, 64, 3)."""
    line, weights = gauss(n_gauss)
    return np.linalg.det(jacobians(points, volume_basis(line)[1])) * tensor(*[weights] * 3)


def jacobians(points: np.ndarray, gradients: np.ndarray) -> np.ndarray:
    """(E, q, m, 3) dx_i / da of coefficients (E, 64, m); gradients (3, q, 64)."""
    return np.einsum("aqm,emi->eqia", gradients, points, optimize=True)


def inverse(matrix: np.ndarray) -> np.ndarray:
    """(..., 3, 3) inverse matrices, by cross products, which are faster than a factorization."""
    a, b, c = np.moveaxis(matrix, -1, 0)
    rows = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=-2)
    return rows / (rows[..., :1, :] @ a[..., None])


def energy_error(
    solution: tuple[Spline, np.ndarray, OfGradient],
    recovered: np.ndarray,
    volume: np.ndarray,
    work: OfField,
    without: np.ndarray | None = None,
) -> tuple[float, float]:
    """Error of a field in the energy norm, relative (Zienkiewicz and Zhu 1987), and its energy.

    solution : the first arguments of `gradient_field`.  recovered : (B, n) the averaged field
    volume : (E, q) of the Gauss points.  work : function of a field (E, q, n) -> (E, q)
    without : (B, n) part of the function of the gradient that is not in the field
    """
    line, nodes = gauss(round(np.cbrt(volume.shape[1])))[0], solution[0].nodes
    basis, raw = volume_basis(line)[0], at_places(*solution, line)
    if without is not None:
        raw -= basis @ without[nodes]
    smooth = basis @ recovered[nodes]
    rest, own, energy = (float((volume * work(f)).sum()) for f in (smooth - raw, smooth, raw))
    return np.sqrt(rest / max(own, TINY)), energy


def field_of(spline: Spline, nodal: np.ndarray, of: OfField) -> np.ndarray:
    """(B,) Bezier coefficients of a function of a field, exact at the points of `samples`.

    nodal : (B, n) Bezier coefficients of the field
    of : function of values (E, 64, n) -> (E, 64)
    """
    return _shared(spline, TO_BEZIER @ of(samples(spline, nodal))[..., None])[:, 0]


def samples(spline: Spline, nodal: np.ndarray) -> np.ndarray:
    """(E, 64, n) values of a field (B, n) at 4^3 evenly spaced points of each element."""
    return EVEN @ nodal[spline.nodes]


def _shared(spline: Spline, values: np.ndarray, poor: np.ndarray | None = None) -> np.ndarray:
    """(B, n) mean over the elements of each node without poor ones (E,); values (E, 64, n)."""
    nodes, size = spline.nodes.ravel(), spline.extraction.shape[0]
    weight = np.ones(len(nodes))
    if poor is not None:
        weight[np.repeat(poor, 64)] = ALMOST_NONE
    total = csr_matrix((weight, (nodes, np.arange(len(nodes)))), (size, len(nodes)))
    count = np.bincount(nodes, weight, size)
    count[count == 0] = 1
    return total @ values.reshape(len(nodes), -1) / count[:, None]
