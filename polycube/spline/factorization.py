"""Direct solution with a sparse symmetric positive definite matrix."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import splu


def factorize(matrix: csr_matrix) -> Callable[[np.ndarray], np.ndarray]:
    """The inverse as a function of right-hand sides (n,) or (n, k); factored without pivoting."""
    return splu(
        matrix.tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    ).solve
