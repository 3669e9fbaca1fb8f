"""Quadratic springs at points of a hex mesh: energy, gradient, and changes of their weights."""

from typing import NamedTuple

import numpy as np
from numba import njit


class Springs(NamedTuple):
    """Quadratic springs: sum along (n . r)^2 + every |r|^2 with r = sum_k share_k x_k - goal."""

    vertex: np.ndarray  # (S, 4) int64
    share: np.ndarray  # (S, 4)
    goal: np.ndarray  # (S, 3)
    direction: np.ndarray  # (S, 3) unit vectors n
    along: np.ndarray  # (S,)
    every: np.ndarray  # (S,)

    def gaps(self, x: np.ndarray) -> np.ndarray:
        """(S, 3) vectors r for points x (V, 3)."""
        return np.einsum("sk,skd->sd", self.share, x[self.vertex]) - self.goal


def pull(
    vertex: np.ndarray,
    goal: np.ndarray,
    direction: np.ndarray,
    along: np.ndarray,
    every: np.ndarray,
) -> Springs:
    """Springs on single vertices (S,)."""
    index = np.repeat(vertex[:, None], 4, axis=1)
    return Springs(index, np.tile([1.0, 0, 0, 0], (len(vertex), 1)), goal, direction, along, every)


NO_SPRINGS = pull(np.zeros(0, int), *np.zeros((2, 0, 3)), *np.zeros((2, 0)))


def together(springs: list[Springs]) -> Springs:
    """All springs of a list."""
    return Springs(
        *(np.ascontiguousarray(np.concatenate(part)) for part in zip(*springs, strict=True))
    )


def between(ends: tuple[float, float], step: float) -> float:
    """Value between the first and the last one, at a step from 0 to 1, in equal ratios."""
    return ends[0] * (ends[1] / ends[0]) ** step


def adjusted(
    trust: np.ndarray, bad: np.ndarray, lower: float = 0.4, least: float = 0.02, rise: float = 1.3
) -> np.ndarray:
    """Weights (V,) of the springs at vertices: lower where `bad` (V,), elsewhere rising to 1."""
    return np.where(bad, np.maximum(lower * trust, least), np.minimum(rise * trust, 1))


@njit(cache=True, nogil=True)
def spring_energy(x: np.ndarray, springs: Springs, gradient: np.ndarray) -> float:
    """Energy at the points x (V, 3); its gradient is added to `gradient` (V, 3)."""
    total = 0.0
    for s in range(len(springs.goal)):
        r0, r1, r2 = -springs.goal[s, 0], -springs.goal[s, 1], -springs.goal[s, 2]
        for k in range(4):
            share, v = springs.share[s, k], springs.vertex[s, k]
            if share != 0:
                r0 += share * x[v, 0]
                r1 += share * x[v, 1]
                r2 += share * x[v, 2]
        n = springs.direction[s]
        off = r0 * n[0] + r1 * n[1] + r2 * n[2]
        along, every = springs.along[s], springs.every[s]
        total += along * off * off + every * (r0 * r0 + r1 * r1 + r2 * r2)
        g0 = 2 * (along * off * n[0] + every * r0)
        g1 = 2 * (along * off * n[1] + every * r1)
        g2 = 2 * (along * off * n[2] + every * r2)
        for k in range(4):
            share, v = springs.share[s, k], springs.vertex[s, k]
            if share != 0:
                gradient[v, 0] += share * g0
                gradient[v, 1] += share * g1
                gradient[v, 2] += share * g2
    return total
