"""A symmetric matrix of blocks times vectors, on several threads.

Each part of the rows has its own sums, which are added in a fixed order, so the result does not
depend on the number of threads.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numba import njit
from scipy.sparse import bsr_matrix, csr_matrix

from polycube.numerics.threads import parts, side_by_side

LEAST = 500  # rows of blocks above which two parts are used


@dataclass(frozen=True, eq=False)
class Symmetric:
    """A symmetric matrix of C x C blocks (n, n), stored as its lower triangle."""

    indptr: np.ndarray  # (C + 1,)
    indices: np.ndarray  # (Z,) columns of each row, ascending; the last is the diagonal
    blocks: np.ndarray  # (Z, n, n)

    @property
    def shape(self) -> tuple[int, int]:
        """Shape (n C, n C)."""
        size = self.blocks.shape[1] * (len(self.indptr) - 1)
        return size, size

    def full(self) -> bsr_matrix:
        """The matrix with both triangles."""
        above = self.blocks.copy()
        above[self.indptr[1:] - 1] = 0  # the diagonal is in the lower triangle
        lower = bsr_matrix((self.blocks, self.indices, self.indptr), self.shape)
        return lower + bsr_matrix((above, self.indices, self.indptr), self.shape).T

    def __matmul__(self, x: np.ndarray) -> np.ndarray:
        """Product with vectors (n C,) or (n C, k)."""
        n, size = self.blocks.shape[1], len(self.indptr) - 1
        columns = np.ascontiguousarray(x, self.blocks.dtype).reshape(size, n, -1)
        if n != 3:
            lower = csr_matrix(bsr_matrix((self.blocks, self.indices, self.indptr), self.shape))
            twice = self.blocks[self.indptr[1:] - 1] @ columns  # the diagonal is in both triangles
            return lower @ x + lower.T @ x - twice.reshape(x.shape)
        cuts = parts(size, LEAST)
        sums = np.zeros((len(cuts), *columns.shape), columns.dtype)
        given = partial(_three, self.indptr, self.indices, self.blocks, columns)
        pairs = zip(cuts, sums, strict=True)
        side_by_side([partial(given, cut.start, cut.stop, own) for cut, own in pairs])
        for own in sums[1:]:
            sums[0] += own
        return sums[0].reshape(x.shape)


@njit(cache=True, nogil=True)
def _three(
    indptr: np.ndarray,
    indices: np.ndarray,
    blocks: np.ndarray,
    x: np.ndarray,
    first: int,
    last: int,
    total: np.ndarray,
) -> None:
    """Add the contributions of rows `first` to `last`, and their transposes, to total (C, 3, k).

    The compiler vectorises these loops; for blocks of 3 x 3 they are faster than those of scipy.
    """
    k = x.shape[2]
    own = np.empty(3 * k, x.dtype)
    for row in range(first, last):
        here = x[row].ravel()
        own[:] = 0
        end = indptr[row + 1] - 1
        for at in range(indptr[row], end):
            b, there, change = blocks[at], x[indices[at]], total[indices[at]]
            xx, xy, xz = b[0, 0], b[0, 1], b[0, 2]
            yx, yy, yz = b[1, 0], b[1, 1], b[1, 2]
            zx, zy, zz = b[2, 0], b[2, 1], b[2, 2]
            for m in range(k):
                x0, x1, x2 = there[0, m], there[1, m], there[2, m]
                own[m] += xx * x0 + xy * x1 + xz * x2
                own[k + m] += yx * x0 + yy * x1 + yz * x2
                own[2 * k + m] += zx * x0 + zy * x1 + zz * x2
            for m in range(k):
                x0, x1, x2 = here[m], here[k + m], here[2 * k + m]
                change[0, m] += xx * x0 + yx * x1 + zx * x2
                change[1, m] += xy * x0 + yy * x1 + zy * x2
                change[2, m] += xz * x0 + yz * x1 + zz * x2
        for i in range(3):
            for m in range(k):
                for j in range(3):
                    own[i * k + m] += blocks[end, i, j] * here[j * k + m]
                total[row, i, m] += own[i * k + m]
