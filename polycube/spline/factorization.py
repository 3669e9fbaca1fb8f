"""Direct solution with a sparse symmetric positive definite matrix: multifrontal Cholesky.

Each front of a nested dissection is a dense matrix of its own unknowns and of the later ones they
touch.  Its own are eliminated, and what that does to the others is added to the parent's front.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg.blas import dsyrk, dtrsm, dtrsv
from scipy.linalg.lapack import dpotrf
from scipy.sparse import coo_matrix, csc_matrix, csr_matrix
from scipy.sparse.csgraph import reverse_cuthill_mckee

from polycube.spline.dissection import dissect


@dataclass(frozen=True, eq=False)
class Factor:
    """Lower triangle by fronts; unknowns in the order of elimination."""

    order: np.ndarray  # (n,) unknown at each place
    starts: np.ndarray  # (F + 1,) places of each front's own unknowns
    later: list[np.ndarray]  # places of the other unknowns of each front
    diagonal: list[np.ndarray]  # (own, own) lower triangles
    below: list[np.ndarray]  # (later, own)

    @property
    def entries(self) -> int:
        """Numbers kept."""
        return sum(a.size for a in (*self.diagonal, *self.below))

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Solution (n,) or (n, k) for right-hand sides."""
        columns = np.asarray(right, np.float64).reshape(len(self.order), -1).T
        found = np.stack([self._solve(column) for column in columns], axis=-1)
        return found.reshape(np.shape(right))

    def _solve(self, right: np.ndarray) -> np.ndarray:
        x = right[self.order]
        fronts = list(zip(self.starts, self.starts[1:], self.later, strict=False))
        for (a, b, later), low, below in zip(fronts, self.diagonal, self.below, strict=True):
            x[a:b] = dtrsv(low, x[a:b], lower=1)
            x[later] -= below @ x[a:b]
        for k in range(len(fronts) - 1, -1, -1):
            a, b, later = fronts[k]
            x[a:b] -= self.below[k].T @ x[later]
            x[a:b] = dtrsv(self.diagonal[k], x[a:b], lower=1, trans=1)
        found = np.zeros_like(x)
        found[self.order] = x
        return found


def factorize(matrix: csr_matrix, points: np.ndarray | None = None) -> Factor:
    """Cholesky factor of a symmetric positive definite matrix.

    points : (n, 3) where each unknown is, more or less; only the time depends on it
    Raises ValueError when the matrix is not positive definite.
    """
    fronts = dissect(matrix, _in_a_row(matrix) if points is None else points)
    order = np.concatenate([front.own for front in fronts])
    starts = np.cumsum([0, *(len(front.own) for front in fronts)])
    ordered = csc_matrix(csr_matrix(matrix)[order][:, order])
    later, diagonal, below, updates = [], [], [], {}
    for k, front in enumerate(fronts):
        a, b = starts[k], starts[k + 1]
        entries = ordered[:, a:b].tocoo()
        pending = [updates.pop(child) for child in front.children]
        others = np.unique(np.concatenate([entries.row, *(places for places, _ in pending)]))
        others = others[others >= b]
        dense, rest = _assemble(a, b, others, entries, pending)
        low, failed = dpotrf(dense[: b - a], lower=1, clean=1)
        if failed:
            raise ValueError("matrix is not positive definite")
        side = dense[b - a :]
        if len(others):
            side = dtrsm(1.0, low, side, side=1, lower=1, trans_a=1)
            rest = dsyrk(-1.0, side, beta=1.0, c=rest, lower=1, overwrite_c=1)
        updates[k] = others, rest
        later.append(others)
        diagonal.append(low)
        below.append(side)
    return Factor(order, starts, later, diagonal, below)


def _in_a_row(matrix: csr_matrix) -> np.ndarray:
    """(n, 3) places along a line on which neighbours are near each other."""
    places = np.zeros((matrix.shape[0], 3))
    places[reverse_cuthill_mckee(csr_matrix(matrix), symmetric_mode=True), 0] = np.arange(
        len(places)
    )
    return places


def _assemble(
    a: int,
    b: int,
    others: np.ndarray,
    entries: coo_matrix,
    pending: list[tuple[np.ndarray, np.ndarray]],
) -> tuple[np.ndarray, np.ndarray]:
    """Dense columns of the own unknowns (own + later, own), and the rest (later, later), lower.

    entries : of the matrix, columns a to b.  pending : places and update of each child
    """
    n = b - a
    dense = np.zeros((n + len(others), n), order="F")
    rest = np.zeros((len(others), len(others)), order="F")

    def local(places: np.ndarray) -> np.ndarray:
        return np.where(places < b, places - a, n + np.searchsorted(others, places))

    kept = entries.row >= a
    dense[local(entries.row[kept]), entries.col[kept]] = entries.data[kept]
    for places, update in pending:
        at = local(places)
        cut = np.searchsorted(places, b)
        dense[np.ix_(at, at[:cut])] += update[:, :cut]
        rest[np.ix_(at[cut:] - n, at[cut:] - n)] += update[cut:, cut:]
    return dense, rest
