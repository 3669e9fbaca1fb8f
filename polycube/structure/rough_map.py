"""Rough maps from a polycube to the model: evaluation, construction, and fit to point pairs.

A rough map is trilinear between control positions on a rectilinear lattice, and linear outside it.
The fit starts with a robust affine map of positive determinant and adds the smoothest displacement
that reproduces the points. The weights of outliers are reduced (iteratively reweighted least
squares).
"""

import numpy as np
from scipy.linalg import solve
from scipy.sparse import csr_matrix

from polycube.types import PerAxis, Polycube, RoughMap

SPACING = 1 / 3  # spacing of the control lattice, in cells
ROUNDS = 12  # rounds of reweighting


def evaluate(rough_map: RoughMap, points: np.ndarray) -> np.ndarray:
    """(N, 3) images in the model of points (N, 3) of the polycube."""
    axes = (rough_map.x, rough_map.y, rough_map.z)
    return weights(axes, points) @ rough_map.positions.reshape(-1, 3)


def weights(axes: PerAxis, points: np.ndarray) -> csr_matrix:
    """(N, X*Y*Z) trilinear weights of the control positions at points; each row has the sum 1."""
    lower, fraction = np.empty(points.shape, int), np.empty(points.shape)
    for axis, knots in enumerate(axes):
        i = np.clip(np.searchsorted(knots, points[:, axis], "right") - 1, 0, len(knots) - 2)
        lower[:, axis] = i
        fraction[:, axis] = (points[:, axis] - knots[i]) / (knots[i + 1] - knots[i])
    shape = tuple(len(knots) for knots in axes)
    columns, values = [], []
    for corner in np.ndindex(2, 2, 2):
        columns.append(np.ravel_multi_index((lower + corner).T, shape))
        values.append(np.where(corner, fraction, 1 - fraction).prod(axis=1))
    rows = np.tile(np.arange(len(points)), 8)
    entries = (np.concatenate(values), (rows, np.concatenate(columns)))
    return csr_matrix(entries, shape=(len(points), int(np.prod(shape))))


def identity_map(polycube: Polycube) -> RoughMap:
    """The identity map."""
    return affine_map(polycube, np.eye(3), np.zeros(3))


def affine_map(polycube: Polycube, linear: np.ndarray, offset: np.ndarray) -> RoughMap:
    """The map u -> linear @ u + offset."""
    x, y, z = (knots[[0, -1]] for knots in polycube.knots)
    return RoughMap(x, y, z, _grid((x, y, z)) @ linear.T + offset)


def _grid(axes: PerAxis) -> np.ndarray:
    """(X, Y, Z, 3) lattice points of three knot vectors."""
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def fit(
    points: np.ndarray,
    targets: np.ndarray,
    polycube: Polycube,
    *,
    smoothness: float = 1e-4,
    outlier: float = 0.1,
) -> RoughMap:
    """Rough map from points (N, 3) of the polycube to points (N, 3) of the model.

    smoothness : weight of the second differences relative to the mean squared distance
    outlier : distance at which the weight of a point is a quarter, as a share of the diagonal

    The smoothness is multiplied by ten until the map preserves orientation on its whole lattice.
    """
    if points.shape != targets.shape or len(points) < 4:
        what = f"fit needs at least 4 pairs of points; got {points.shape}, {targets.shape}"
        raise ValueError(what)
    low, scale = targets.min(axis=0), float(np.linalg.norm(np.ptp(targets, axis=0)))
    goal = (targets - low) / scale
    linear, offset = _affine(points, goal, outlier)
    parts = (round(np.ptp(knots) / SPACING) or 1 for knots in polycube.knots)
    x, y, z = (np.linspace(k[0], k[-1], n + 1) for k, n in zip(polycube.knots, parts, strict=True))
    axes = x, y, z  # control planes
    base = _grid(axes) @ linear.T + offset
    shares, bending = weights(axes, points), _bending(axes)
    residual = goal - points @ linear.T - offset
    for stiffness in smoothness * 10.0 ** np.arange(6):
        moved = _robust(shares, bending * stiffness, residual, outlier)
        positions = base + moved.reshape(base.shape)
        if _keeps_orientation(positions):
            break
    else:
        positions = base
    return RoughMap(x, y, z, positions * scale + low)


def _affine(points: np.ndarray, goal: np.ndarray, outlier: float) -> tuple[np.ndarray, np.ndarray]:
    """Robust affine map from points to goal with a positive determinant.

    Singular values are at least a quarter of the largest one, so that no direction collapses.
    """
    homogeneous = np.column_stack([points, np.ones(len(points))])
    weight = np.ones(len(points))
    for _ in range(ROUNDS):
        root = np.sqrt(weight)[:, None]
        solution = np.linalg.lstsq(homogeneous * root, goal * root, rcond=None)[0]
        weight = _trust(goal - homogeneous @ solution, 2 * outlier)
    left, singular, right = np.linalg.svd(solution[:3].T)
    flip = np.array([1, 1, np.sign(np.linalg.det(left @ right))])
    linear = (left * np.maximum(singular, singular[0] / 4) * flip) @ right
    centre = (weight @ points) / weight.sum(), (weight @ goal) / weight.sum()
    return linear, centre[1] - linear @ centre[0]


def _trust(residual: np.ndarray, outlier: float) -> np.ndarray:
    """(N,) weights of points at the given distances: 1 at 0, 1/4 at `outlier`, 0 far away."""
    return (1 + (residual**2).sum(axis=1) / outlier**2) ** -2.0


def _bending(axes: PerAxis) -> np.ndarray:
    """Quadratic form of all second differences of a field on the control lattice.

    A small multiple of the identity makes it definite.
    """
    sizes = [len(knots) for knots in axes]
    form = 1e-4 * np.eye(int(np.prod(sizes)))
    for order in np.ndindex(3, 3, 3):
        if sum(order) == 2:
            parts = [np.diff(np.eye(n), k, axis=0) for n, k in zip(sizes, order, strict=True)]
            rows = np.kron(np.kron(parts[0], parts[1]), parts[2])
            form += (1 if 2 in order else 2) * rows.T @ rows
    return form


def _robust(
    weights: csr_matrix, energy: np.ndarray, residual: np.ndarray, outlier: float
) -> np.ndarray:
    """(X*Y*Z, 3) displacement of the control positions that reproduces the residual."""
    moved = np.zeros((weights.shape[1], 3))
    for step in range(ROUNDS):
        reach = outlier * max(1.0, 3 - 4 * step / ROUNDS)  # wide in the first steps
        trust = _trust(residual - weights @ moved, reach)
        weighted = weights.multiply((trust / trust.sum())[:, None]).T.tocsr()
        moved = solve((weighted @ weights).toarray() + energy, weighted @ residual, assume_a="pos")
    return moved


def _keeps_orientation(positions: np.ndarray) -> bool:
    """Whether the three edges at every corner of every control cell are right-handed."""
    x, y, z = (n - 1 for n in positions.shape[:3])
    along = [np.diff(positions, axis=axis) for axis in range(3)]
    signs = []
    for a, b, c in np.ndindex(2, 2, 2):
        first, second = along[0][:, b : y + b, c : z + c], along[1][a : x + a, :, c : z + c]
        third = along[2][a : x + a, b : y + b]
        signs.append(np.einsum("...i,...i", first, np.cross(second, third)).min())
    return min(signs) > 0
