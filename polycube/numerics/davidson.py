"""Lowest eigenpairs of K x = lambda M x by a block Davidson method.

The space is extended by P r, the preconditioned residuals r = K x - theta M x of the Ritz vectors
that have not converged. If P is close to the inverse of K - shift M, this is inverse iteration
accelerated by the previous iterations. P may be inaccurate: the result depends on K and M only.
LOBPCG of scipy is slower and less accurate, and only warns if it does not converge.
"""

import logging
from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.sparse import spmatrix
from scipy.sparse.linalg import LinearOperator

from polycube.errors import MeshingError
from polycube.numerics.threads import parts, side_by_side

logger = logging.getLogger(__name__)

TOLERANCE = 1e-10
VECTORS_PER_PAIR = 6  # vectors stored per requested pair, before a restart with a quarter of them
ROUNDING = 1e-6  # residual below which one that does not halve in PATIENCE iterations is final
PATIENCE = 3
ITERATIONS = 500  # largest number of iterations
ROWS = 4000  # rows of tall matrices above which two threads are used
DEPENDENT = 1e-14  # of the largest squared length: smaller directions are omitted


def davidson(
    stiffness: spmatrix,
    mass: spmatrix | LinearOperator,
    precondition: Callable[[np.ndarray], np.ndarray],
    n_pairs: int,
    shift: float,
    tolerance: float = TOLERANCE,
) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues (K,), ascending, and M-orthonormal vectors (N, K).

    precondition : (N, k) -> (N, k), approximate inverse of K - shift M, which is positive definite
    tolerance : of the residual, in the norm of the inverse, relative to the root of lambda - shift;
        the relative error of an eigenvalue is its square

    Stops at the tolerance, or if rounding errors prevent a smaller residual. Raises MeshingError if
    neither is reached within ITERATIONS.
    """
    start = np.random.default_rng(0).standard_normal((stiffness.shape[0], n_pairs))
    space = _Space(stiffness, mass, VECTORS_PER_PAIR * max(n_pairs, 4))
    space.add(precondition(mass @ start))
    error = np.full(n_pairs, np.inf)  # of each pair at its last check
    errors: list[float] = []
    while True:
        values, x, kx, mx = space.ritz(n_pairs)
        left = np.flatnonzero(error > tolerance)
        residual = kx[:, left] - mx[:, left] * values[left]
        better = precondition(residual)
        energy = np.einsum("nk,nk->k", residual, better)
        error[left] = np.sqrt(np.maximum(energy, 0) / (values[left] - shift))
        errors.append(error.max())
        before = min(errors[:-PATIENCE], default=np.inf)
        if errors[-1] <= tolerance or (before < ROUNDING and min(errors) > before / 2):
            break
        if len(errors) == ITERATIONS:
            what = f"the modes did not converge in {ITERATIONS} iterations"
            raise MeshingError(f"{what}: residual {errors[-1]:.1e}")
        space.add(better[:, error[left] > tolerance])
    message = "eigenvalues %.3g to %.3g after %d iterations, %d vectors, residual at most %.1e"
    logger.info(message, values[0], values[-1], len(errors), space.seen, errors[-1])
    return values, x


class _Space:
    """M-orthonormal vectors V, K V and M V."""

    def __init__(self, stiffness: spmatrix, mass: LinearOperator, capacity: int) -> None:
        """`capacity` : largest number of vectors; more are reduced to the lowest Ritz vectors."""
        self.stiffness, self.mass = stiffness, mass
        self.seen = self.size = 0
        self._vectors = np.zeros((3, stiffness.shape[0], capacity))
        self._small = np.zeros((capacity, capacity))  # V^T K V

    def add(self, w: np.ndarray) -> None:
        """Extend the space by the columns of w (N, k), made M-orthonormal."""
        self.seen += w.shape[1]
        if self.size + w.shape[1] > self._vectors.shape[2]:
            self._reduce(self._vectors.shape[2] // 4)
        v, _, mv = self._vectors[..., : self.size]
        w = w / np.linalg.norm(w, axis=0)
        w = w - _combined(v, _products(mv, w))
        w, mw = _orthonormal(w, self.mass @ w)
        along = _products(mv, w)  # again, because of rounding errors
        w, mw = _orthonormal(w - _combined(v, along), mw - _combined(mv, along))
        kw = self.stiffness @ w
        new = slice(self.size, self.size + w.shape[1])
        for part, columns in zip(self._vectors, (w, kw, mw), strict=True):
            part[:, new] = columns
        self.size = new.stop
        coupling = _products(self._vectors[0, :, : self.size], kw)
        self._small[: self.size, new] = coupling
        self._small[new, : self.size] = coupling.T

    def ritz(self, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Lowest n Ritz values (n,), vectors x (N, n), K x and M x."""
        values, turn = np.linalg.eigh(self._small[: self.size, : self.size])
        x, kx, mx = (_combined(part[:, : self.size], turn[:, :n]) for part in self._vectors)
        return values[:n], x, kx, mx

    def _reduce(self, n: int) -> None:
        values, *lowest = self.ritz(n)
        self._vectors[..., :n] = lowest
        self._small[:n, :n] = np.diag(values)
        self.size = n


def _orthonormal(w: np.ndarray, mw: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """M-orthonormal combinations of vectors w, and of M w; dependent ones are omitted."""
    lengths, turn = np.linalg.eigh(_products(w, mw))
    long = lengths > DEPENDENT * lengths[-1]
    turn = turn[:, long] / np.sqrt(lengths[long])
    return w @ turn, mw @ turn


def _products(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a^T b of tall matrices, summed in an order independent of the number of threads."""
    cuts = parts(len(a), ROWS)
    return np.sum(side_by_side([partial(np.matmul, a[cut].T, b[cut]) for cut in cuts]), axis=0)


def _combined(a: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """A tall matrix times a small one."""
    found = np.empty((len(a), turn.shape[1]))
    side_by_side([partial(np.matmul, a[cut], turn, out=found[cut]) for cut in parts(len(a), ROWS)])
    return found
