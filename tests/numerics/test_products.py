import numpy as np
import pytest
from scipy.sparse import coo_matrix

from polycube.numerics.products import LEAST, Symmetric


def random_matrix(size, n, dtype=np.float64):
    """A banded symmetric matrix of blocks, and the same as dense."""
    rng = np.random.default_rng(4)
    dense = rng.normal(size=(size, n, size, n)).astype(dtype)
    dense = dense + dense.transpose(2, 3, 0, 1)
    row, column = np.nonzero(np.tri(size, dtype=bool) & ~np.tri(size, k=-9, dtype=bool))
    indptr = np.searchsorted(row, np.arange(size + 1)).astype(np.int32)
    mask = np.zeros((size, size), bool)
    mask[row, column] = mask[column, row] = True
    dense *= mask[:, None, :, None]
    blocks = dense.transpose(0, 2, 1, 3)[row, column].copy()
    matrix = Symmetric(indptr, column.astype(np.int32), blocks)
    return matrix, dense.reshape(size * n, size * n)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_agrees_with_the_dense_matrix(n):
    matrix, dense = random_matrix(30, n)
    x = np.random.default_rng(5).normal(size=(30 * n, 4))
    assert matrix.shape == dense.shape
    assert np.array_equal(matrix.full().toarray(), dense)
    assert matrix @ x == pytest.approx(dense @ x, abs=1e-12)
    assert matrix @ x[:, 0] == pytest.approx(dense @ x[:, 0], abs=1e-12)


@pytest.mark.parametrize("n", [1, 3])
def test_product_does_not_depend_on_the_number_of_threads(n, on_cores):
    size = 4 * LEAST
    place = np.arange(size)
    rng = np.random.default_rng(6)
    rows = np.concatenate([place, place[1:], place[7:]])
    columns = np.concatenate([place, place[:-1], place[:-7]])
    lower = coo_matrix((np.ones(len(rows)), (rows, columns))).tocsr()
    lower.sort_indices()
    matrix = Symmetric(lower.indptr, lower.indices, rng.normal(size=(lower.nnz, n, n)))
    x = rng.normal(size=(size * n, 5))
    on_cores(4)
    found = matrix @ x
    assert found == pytest.approx(matrix.full() @ x, abs=1e-12)
    on_cores(1)
    assert np.array_equal(matrix @ x, found)
