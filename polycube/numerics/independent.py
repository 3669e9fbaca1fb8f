"""Functions that span others, from their Gram matrix."""

import numpy as np
from scipy.sparse import csc_matrix, diags, eye
from scipy.sparse.linalg import splu

DEPENDENT = 1e-9  # pivot of the Gram matrix of unit diagonal below which a trace is dependent


def independent(gram: csc_matrix) -> np.ndarray:
    """(n,) functions whose traces span those of all; of two dependent ones, the larger."""
    norm = gram.diagonal()
    scale = diags(1 / np.sqrt(norm))
    unit = scale @ gram @ scale + 1e-13 * eye(len(norm))
    if _pivots(csc_matrix(unit), "MMD_AT_PLUS_A").min() > DEPENDENT:
        return np.ones(len(norm), bool)
    order = np.argsort(-np.round(norm / norm.max(), 6), kind="stable")
    found = np.zeros(len(norm), bool)
    found[order] = _pivots(csc_matrix(unit.tocsr()[order][:, order]), "NATURAL") > DEPENDENT
    return found


def _pivots(matrix: csc_matrix, order: str) -> np.ndarray:
    """(n,) pivots of the Cholesky factorisation, by column."""
    factor = splu(matrix, permc_spec=order, diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return factor.U.diagonal()[factor.perm_c]
