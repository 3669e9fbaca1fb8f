"""det J of tricubic elements on a grid: values, minima, and squared shortfall."""

from functools import partial

import numpy as np

from polycube.numerics.threads import side_by_side
from polycube.spline.bernstein import bernstein, derivative, tensor

CHUNK = 64  # elements in one batch; their tangents at 9^3 points take 3 MB


def detj(points: np.ndarray, nodes: np.ndarray, line: np.ndarray) -> np.ndarray:
    """(E, n^3) det J of elements with Bezier points[nodes] on the grid line x line x line.

    points : (B, 3).  nodes : (E, 64).  line : (n,) parameters
    """
    batches = [partial(_values, points, part, line) for part in _chunks(nodes)]
    return np.concatenate([values.T for values in side_by_side(batches)])


def least_detj(
    points: np.ndarray, nodes: np.ndarray, line: np.ndarray, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(E,) smallest value of each element on the grid, and weighted sums (E,) of the values.

    weights : (n,) weights of a quadrature rule on the line, used as a tensor product
    """
    cube = tensor(weights, weights, weights)

    def least(part: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values = _values(points, part, line)
        return values.min(axis=0), cube @ values

    found = side_by_side([partial(least, part) for part in _chunks(nodes)])
    minima, sums = (np.concatenate(column) for column in zip(*found, strict=True))
    return minima, sums


def squared_shortfall(
    points: np.ndarray, nodes: np.ndarray, line: np.ndarray, unit: np.ndarray, wanted: float
) -> tuple[float, np.ndarray]:
    """Sum of max(wanted - det J / unit, 0)^2 over elements and grid, and its gradient (B, 3).

    unit : (E,) scale of each element
    """
    tangents = _tangents(points, nodes, line)
    shortfall = np.maximum(wanted - _determinants(tangents) / unit, 0)
    short = np.flatnonzero(shortfall.any(axis=0))  # only these have a gradient
    shortfall, (a, b, c) = shortfall[:, short], tangents[..., short]
    factor = -2 * shortfall / unit[short]
    by_tangent = (factor * np.cross(x, y, axis=0) for x, y in ((b, c), (c, a), (a, b)))
    turned = (tuple(table.T for table in tables) for tables in _slopes(line))
    by_net = np.sum([*map(_along_axes, by_tangent, turned)], axis=0).reshape(3, -1)
    at, size = nodes[short].T.ravel(), len(points)
    gradient = [np.bincount(at, column, size) for column in by_net]
    return float((shortfall**2).sum()), np.stack(gradient, axis=1)


def _slopes(line: np.ndarray) -> tuple[tuple[np.ndarray, ...], ...]:
    """Tables (n, 4) along zeta, eta, xi for the derivatives by xi, eta and zeta on a line."""
    b, d = bernstein(line), derivative(line)
    return (b, b, d), (b, d, b), (d, b, b)


def _along_axes(values: np.ndarray, tables: tuple[np.ndarray, ...]) -> np.ndarray:
    """Apply tables (m, n) along three axes in turn to tensors (3, n^3, E): (3, m^3, E)."""
    for axis, table in enumerate(tables):
        m, n = table.shape
        values = table @ values.reshape(3 * m**axis, n, -1)
    return values.reshape(3, m**3, -1)


def _chunks(nodes: np.ndarray) -> list[np.ndarray]:
    return np.array_split(nodes, len(nodes) // CHUNK + 1)


def _tangents(points: np.ndarray, nodes: np.ndarray, line: np.ndarray) -> np.ndarray:
    """(3, 3, n^3, E) derivatives by each parameter, of each coordinate."""
    net = points.T[:, nodes.T]
    return np.stack([_along_axes(net, tables) for tables in _slopes(line)])


def _determinants(tangents: np.ndarray) -> np.ndarray:
    """(n^3, E) determinants of tangents (3, 3, n^3, E)."""
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = tangents
    return ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)


def _values(points: np.ndarray, nodes: np.ndarray, line: np.ndarray) -> np.ndarray:
    """(n^3, E) values of det J."""
    return _determinants(_tangents(points, nodes, line))
