"""det J of tricubic elements on a grid: values, minima, and squared shortfall."""

from functools import partial

import numpy as np

from polycube.numerics.threads import side_by_side
from polycube.spline.bernstein import tensor, volume_basis

CHUNK = 64  # elements in one batch; their tangents at 9^3 points take 3 MB


def detj(points: np.ndarray, nodes: np.ndarray, line: np.ndarray) -> np.ndarray:
    """(E, n^3) det J of elements with Bezier points[nodes] on the grid line x line x line.

    points : (B, 3).  nodes : (E, 64).  line : (n,) parameters
    """
    slopes = _slopes(line)
    batches = [partial(_values, points, part, slopes) for part in _chunks(nodes)]
    return np.concatenate([values.T for values in side_by_side(batches)])


def least_detj(
    points: np.ndarray, nodes: np.ndarray, line: np.ndarray, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(E,) smallest value of each element on the grid, and weighted sums (E,) of the values.

    weights : (n,) weights of a quadrature rule on the line, used as a tensor product
    """
    slopes, cube = _slopes(line), tensor(weights, weights, weights)

    def least(part: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values = _values(points, part, slopes)
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
    slopes = _slopes(line)
    a, b, c = _tangents(points, nodes, slopes)
    by_tangent = np.stack([np.cross(x, y, axis=0) for x, y in ((b, c), (c, a), (a, b))], axis=1)
    shortfall = np.maximum(wanted - (a * by_tangent[:, 0]).sum(axis=0) / unit, 0)
    by_tangent *= -2 * shortfall / unit
    by_net = slopes.T @ by_tangent.reshape(3, len(slopes), len(nodes))  # (3, 64, E)
    at, size = nodes.T.ravel(), len(points)
    gradient = [np.bincount(at, column.ravel(), size) for column in by_net]
    return float((shortfall**2).sum()), np.stack(gradient, axis=1)


def _slopes(line: np.ndarray) -> np.ndarray:
    """(3 n^3, 64) derivatives of the tricubic basis on a grid by the three parameters."""
    return volume_basis(line)[1].reshape(-1, 64)


def _chunks(nodes: np.ndarray) -> list[np.ndarray]:
    return np.array_split(nodes, len(nodes) // CHUNK + 1)


def _tangents(points: np.ndarray, nodes: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """(3, 3, n^3, E) derivatives by each parameter, of each coordinate."""
    by_coordinate = slopes @ points.T[:, nodes.T]  # (3, 3 n^3, E)
    return by_coordinate.reshape(3, 3, len(slopes) // 3, len(nodes)).swapaxes(0, 1)


def _values(points: np.ndarray, nodes: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """(n^3, E) values of det J."""
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = _tangents(points, nodes, slopes)
    return ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
