"""Smoothing of plane quads: unfolds them and makes their corners nearly square.

The shape energy of a corner with edges a and b and area d = a x b is (|a|^2 + |b|^2) / (2 d), which
is 1 for a square. A small or negative d is replaced by a small positive area (Escobar et al. 2003).
"""

import numpy as np

from polycube.hexmesh.background.arrangement import cross
from polycube.numerics.lbfgs import descend

ROUNDS = ((0.3, 30), (0.03, 40), (0.003, 60))  # smallest area relative to the mean; iterations
POWER = 2  # exponent of the energies before summation: increases the weight of bad corners


def smoothed(vertices: np.ndarray, quads: np.ndarray, is_free: np.ndarray) -> np.ndarray:
    """(V, 2) positions of vertices with a smaller sum of shape energies.

    vertices : (V, 2)
    quads : (Q, 4) counter-clockwise
    is_free : (V,) whether a vertex can move
    """
    if not is_free.any():
        return vertices
    corner = _corners(quads)
    scale = np.sqrt(abs(cross(*_edges(vertices, corner))).mean())
    places = vertices / scale
    for least, iterations in ROUNDS:

        def energy(free: np.ndarray, least: float = least) -> tuple[float, np.ndarray]:
            now = places.copy()
            now[is_free] = free.reshape(-1, 2)
            value, slope = _energy(now, corner, least)
            return value, slope[is_free].ravel()

        found = descend(energy, places[is_free].ravel(), iterations, step=0.05)
        places[is_free] = found.reshape(-1, 2)
    return places * scale


def sines(vertices: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """(Q,) smallest sine of the angles of each quad; negative if it is folded."""
    a, b = _edges(vertices, _corners(quads))
    length = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
    return (cross(a, b) / np.maximum(length, 1e-300)).reshape(-1, 4).min(axis=1)


def _corners(quads: np.ndarray) -> np.ndarray:
    """(4 Q, 3) vertices of corners, the next one and the previous one."""
    corner = np.stack([quads, np.roll(quads, -1, axis=1), np.roll(quads, 1, axis=1)], axis=2)
    return corner.reshape(-1, 3)


def _energy(places: np.ndarray, corner: np.ndarray, least: float) -> tuple[float, np.ndarray]:
    """Sum over corners, and its gradient (V, 2)."""
    a, b = _edges(places, corner)
    area = cross(a, b)
    root = np.sqrt(area**2 + 4 * least**2)
    positive = (area + root) / 2
    shape = ((a**2).sum(axis=1) + (b**2).sum(axis=1)) / (2 * positive)
    rate = POWER * shape ** (POWER - 1)
    by_area = -rate * shape / positive * (1 + area / root) / 2
    by_length = rate / positive
    to_a = by_length[:, None] * a + by_area[:, None] * np.stack([b[:, 1], -b[:, 0]], axis=1)
    to_b = by_length[:, None] * b + by_area[:, None] * np.stack([-a[:, 1], a[:, 0]], axis=1)
    rows = np.concatenate([corner[:, 1], corner[:, 2], corner[:, 0]])
    parts = np.concatenate([to_a, to_b, -to_a - to_b])
    slope = np.stack([np.bincount(rows, c, len(places)) for c in parts.T], axis=1)
    return float((shape**POWER).sum()), slope


def _edges(places: np.ndarray, corner: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(N, 2) and (N, 2) edges from the first vertex of corners (N, 3) to the others."""
    here = places[corner[:, 0]]
    return places[corner[:, 1]] - here, places[corner[:, 2]] - here
