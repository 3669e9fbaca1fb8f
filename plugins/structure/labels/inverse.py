"""A rough map from bricks to the part, fitted to where its surface lies on them."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix, identity, kron, vstack
from scipy.sparse.linalg import splu

from polycube.structure.rough_map import weights
from polycube.types import PerAxis, RoughMap

SPACING = 0.08  # of the control planes, in diagonals
MOST = 4  # control intervals between two knots
MIXED = 0.5  # weight of mixed differences against second ones
LEAST = 1e-10  # pull to the middle, which settles what no point and no neighbour sees


def fitted(
    knots: list[np.ndarray], placed: np.ndarray, points: np.ndarray, smoothness: float
) -> RoughMap:
    """Least squares for the control positions, with second and mixed differences kept small.

    knots : (K,) places along the axes, by whose distances differences are divided
    placed : (N, 3) in numbers of knots
    points : (N, 3) in the part
    """
    u, v, w = (_control(line) for line in knots)
    pairs = zip((u, v, w), knots, strict=True)
    x, y, z = (np.interp(line, np.arange(len(k)), k) for line, k in pairs)
    shape = (len(x), len(y), len(z))
    size = int(np.prod(shape))
    bending = _differences(shape, (x, y, z))
    matrix = weights((u, v, w), placed)
    middle = points.mean(axis=0)
    normal = matrix.T @ matrix / len(points) + smoothness / size * (bending.T @ bending)
    normal = normal + LEAST * identity(size)
    solver = splu(normal.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    positions = solver.solve(matrix.T @ (points - middle) / len(points)) + middle
    return RoughMap(u, v, w, positions.reshape(*shape, 3))


def _control(knots: np.ndarray) -> np.ndarray:
    """Control planes in numbers of knots: at each knot, and between those that are far apart."""
    parts = np.clip(np.round(np.diff(knots) / SPACING), 1, MOST).astype(int)
    inner = [k + np.arange(count) / count for k, count in enumerate(parts)]
    return np.append(np.concatenate(inner), float(len(parts)))


def _differences(shape: tuple[int, int, int], lengths: PerAxis) -> csr_matrix:
    """Rows of second differences along each axis and of mixed ones across each two."""
    unit = [identity(n, format="csr") for n in shape]
    first = [csr_matrix(np.diff(np.eye(n), axis=0)) for n in shape]
    second = [_second(line) for line in lengths]
    rows = []
    for axis in range(3):
        if shape[axis] > 2:
            parts = [second[a] if a == axis else unit[a] for a in range(3)]
            rows.append(kron(kron(parts[0], parts[1]), parts[2]))
        parts = [unit[a] if a == axis else first[a] for a in range(3)]
        rows.append(MIXED * kron(kron(parts[0], parts[1]), parts[2]))
    return vstack(rows).tocsr()


def _second(line: np.ndarray) -> csr_matrix:
    """(N - 2, N) change of slope at the inner points of a line, times their mean distance."""
    step = np.diff(line)
    mean = (step[1:] + step[:-1]) / 2
    rows = np.zeros((max(len(line) - 2, 0), len(line)))
    at = np.arange(len(rows))
    rows[at, at] = mean / step[:-1]
    rows[at, at + 1] = -mean / step[:-1] - mean / step[1:]
    rows[at, at + 2] = mean / step[1:]
    return csr_matrix(rows)
