"""Fields of the gradient of a solution, such as stress, as Bezier coefficients.

The gradient of a tricubic solution is most accurate at the 3^3 Gauss points of every element
(Barlow 1976). The values there are extrapolated to the Bezier points by a triquadratic polynomial
and averaged over the elements that share a node, so the field is continuous where these do. The
elements of different solids share none: stresses jump where the material changes.
"""

from collections.abc import Callable

import numpy as np
from scipy.sparse import csc_matrix

from polycube.spline.bernstein import bernstein, gauss, tensor, volume_basis
from polycube.spline.bezier import bezier_points
from polycube.types import Spline

CHUNK = 512  # elements in a batch
ALMOST_NONE = 1e-12  # weight of a value that is used only if there is no other
EVEN_LINE = np.arange(4) / 3
EVEN = tensor(*[bernstein(EVEN_LINE)] * 3)
TO_BEZIER = np.linalg.inv(EVEN)
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
    return shared(spline, CARRY @ at_places(spline, nodal, of, BARLOW), poor)


def barlow(n_gauss: int) -> np.ndarray:
    """(64, n^3) Bezier coefficients of `gradient_field` by values at n^3 Gauss points, n >= 4.

    The values at the 3^3 points are those of the tricubic polynomial through the others.
    """
    line = bernstein(BARLOW) @ np.linalg.pinv(bernstein(gauss(n_gauss)[0]))
    return CARRY @ tensor(line, line, line)


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
    nodes: np.ndarray, raw: np.ndarray, recovered: np.ndarray, volume: np.ndarray, work: OfField
) -> tuple[float, float]:
    """Error of a field in the energy norm, relative (Zienkiewicz and Zhu 1987), and its energy.

    nodes : (E, 64).  raw : (E, q, n) the field at the Gauss points.  recovered : (B, n) averaged
    volume : (E, q) of the Gauss points.  work : function of a field (E, q, n) -> (E, q)
    """
    basis = volume_basis(gauss(round(np.cbrt(volume.shape[1])))[0])[0]
    smooth = basis.astype(raw.dtype) @ recovered.astype(raw.dtype)[nodes]
    rest, own, energy = (float((volume * work(f)).sum()) for f in (smooth - raw, smooth, raw))
    return np.sqrt(rest / max(own, TINY)), energy


def field_of(spline: Spline, nodal: np.ndarray, of: OfField) -> np.ndarray:
    """(B,) Bezier coefficients of a function of a field, exact at the points of `samples`.

    nodal : (B, n) Bezier coefficients of the field
    of : function of values (E, 64, n) -> (E, 64)
    """
    values = of(samples(spline, nodal))[..., None]
    return shared(spline, TO_BEZIER.astype(values.dtype) @ values)[:, 0]


def samples(spline: Spline, nodal: np.ndarray) -> np.ndarray:
    """(E, 64, n) values of a field (B, n) at 4^3 evenly spaced points of each element."""
    return EVEN.astype(nodal.dtype) @ nodal[spline.nodes]


def shared(spline: Spline, values: np.ndarray, poor: np.ndarray | None = None) -> np.ndarray:
    """(B, n) mean over the elements of each node without poor ones (E,); values (E, 64, n)."""
    nodes, size = spline.nodes.ravel(), spline.extraction.shape[0]
    weight = np.ones(len(nodes))
    if poor is not None:
        weight[np.repeat(poor, 64)] = ALMOST_NONE
    given = weight.astype(values.dtype), nodes, np.arange(len(nodes) + 1)
    count = np.bincount(nodes, weight, size)
    count[count == 0] = 1
    return csc_matrix(given, (size, len(nodes))) @ values.reshape(len(nodes), -1) / count[:, None]
