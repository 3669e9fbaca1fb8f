"""Elimination order of a sparse symmetric matrix by nested dissection in space.

The unknowns are divided along one of the axes, close to the median, where the separator is
smallest: the unknowns of one half that are adjacent to the other. Both halves are divided likewise
and eliminated before the separator.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

LEAF = 200  # unknowns that are not divided further
SHARES = np.linspace(0.4, 0.6, 5)  # shares of the unknowns below a cut that are tried


@dataclass(frozen=True, eq=False)
class Front:
    """Unknowns eliminated together, after those of its children."""

    own: np.ndarray  # (n,) unknowns
    children: tuple[int, ...]  # earlier fronts, at most two


def dissect(matrix: csr_matrix, points: np.ndarray) -> list[Front]:
    """Fronts in an order of elimination; the last one is the root.

    points : (n, 3) approximate position of each unknown
    """
    touches = np.ones(matrix.nnz)  # values could cancel when the neighbours of a row are counted
    pattern = csr_matrix((touches, matrix.indices, matrix.indptr), matrix.shape)
    # equal rows are one group, also by their products with random numbers
    keys = pattern @ np.random.default_rng(0).random(pattern.shape[0])
    _, first, group = np.unique(keys, return_index=True, return_inverse=True)
    graph = csr_matrix(pattern[first][:, first])
    members = np.split(np.argsort(group, kind="stable"), np.cumsum(np.bincount(group))[:-1])
    size = np.bincount(group)
    fronts: list[Front] = []
    for own, children in _cut(graph, points[first], size, np.arange(len(first)), fronts):
        fronts.append(Front(np.concatenate([members[g] for g in own]), children))
    return fronts


def _cut(
    graph: csr_matrix, points: np.ndarray, size: np.ndarray, nodes: np.ndarray, fronts: list[Front]
) -> Iterator[tuple[np.ndarray, tuple[int, ...]]]:
    """Yield own nodes and children of the fronts of a part, the root last.

    size : unknowns at each node of the graph
    fronts : the fronts yielded so far, a list of the caller
    """
    if size[nodes].sum() <= LEAF:
        yield nodes, ()
        return
    part, weight = graph[nodes][:, nodes], size[nodes]
    choices = [
        choice
        for axis in range(points.shape[1])
        for choice in _separators(part, points[nodes, axis], weight)
    ]

    def cost(choice: tuple[np.ndarray, np.ndarray]) -> float:
        """Unknowns of the separator divided by those of the two parts, multiplied."""
        touching, side = choice
        apart = weight[side & ~touching].sum() * weight[~side].sum()
        return weight[touching].sum() / max(apart, 1e-9)

    none = np.zeros((2, len(nodes)), bool)
    touching, side = min(choices, key=cost, default=(none[0], none[1]))
    if not touching.any():
        # for halves that are not adjacent: a front needs an unknown
        touching[np.argmax(side)] = True
    halves = [nodes[side & ~touching], nodes[~side]]
    if min(map(len, halves)) == 0:
        yield nodes, ()
        return
    children = []
    for half in halves:
        yield from _cut(graph, points, size, half, fronts)
        children.append(len(fronts) - 1)
    yield nodes[touching], tuple(children)


def _separators(
    part: csr_matrix, x: np.ndarray, weight: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Nodes of one side adjacent to the other, and that side, for cuts across x near the median."""
    order = np.argsort(x, kind="stable")
    level = np.round((x[order] - x.min()) / max(np.ptp(x), np.finfo(float).tiny), 6)
    near = level[np.searchsorted(np.cumsum(weight[order]) / weight.sum(), SHARES)]
    places = np.union1d(np.searchsorted(level, near), np.searchsorted(level, near, "right"))
    for place in places[(places > 0) & (places < len(x))]:
        high = np.zeros(len(x), bool)
        high[order[place:]] = True
        for side in (high, ~high):
            yield side & (part @ (~side).astype(np.float64) != 0), side
