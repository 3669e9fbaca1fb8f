import numpy as np
import pytest
from scipy.sparse import csr_matrix, diags, eye, kron, random

from polycube.numerics.factorization import LEAF, dissect, factorize
from tests.fixtures.hexmeshes import hex_cylinder
from tests.fixtures.splines import box, spline_of
from tests.oracles.matrices import assemble


def elastic(spline):
    stiffness, mass = assemble(spline, 1.0, 0.3, 1.0)
    return csr_matrix(stiffness + 0.01 * kron(mass, eye(3))), np.repeat(spline.control, 3, axis=0)


SOLIDS = {
    "bar": lambda: elastic(box((12, 2, 2), (6.0, 1.0, 1.0), "h2s")),
    "cylinder": lambda: elastic(spline_of(hex_cylinder(2, 2, 2))),
}


@pytest.mark.parametrize("solid", SOLIDS)
def test_solves_as_a_dense_solver_does(solid):
    matrix, points = SOLIDS[solid]()
    right = np.random.default_rng(0).normal(size=(len(points), 2))
    exact = np.linalg.solve(matrix.toarray(), right)
    for places in (points, None):
        factor = factorize(matrix, places)
        assert factor.solve(right) == pytest.approx(exact, rel=1e-9, abs=1e-9 * abs(exact).max())
        assert factor.solve(right[:, 0]).shape == (len(points),)


def test_any_sparsity_pattern_is_accepted():
    rng = np.random.default_rng(1)
    loose = random(900, 900, 0.002, rng=rng)
    matrix = csr_matrix(loose + loose.T + diags(np.full(900, 9.0)))
    right = rng.normal(size=900)
    for points in (rng.normal(size=(900, 3)), np.full((900, 3), 30.0), None):
        found = factorize(matrix, points).solve(right)
        assert matrix @ found == pytest.approx(right, abs=1e-11)


def test_disconnected_unknowns():
    """Two connected halves that are not adjacent: no separator is needed."""
    row = np.ones(599)
    row[298] = 0
    matrix = csr_matrix(diags([-row, np.full(600, 4.0), -row], [-1, 0, 1]))
    matrix.eliminate_zeros()
    points = np.arange(600.0)[:, None] * [1.0, 0, 0]
    right = np.random.default_rng(2).normal(size=600)
    assert matrix @ factorize(matrix, points).solve(right) == pytest.approx(right, abs=1e-12)


def cancelling():
    """A chain where each unknown touches the next two, with opposite signs."""
    row = np.ones(700)
    matrix = diags([-row, row, 9 * row, row, -row], [-2, -1, 0, 1, 2], shape=(700, 700))
    return csr_matrix(matrix), np.arange(700.0)[:, None] * [1.0, 0, 0]


@pytest.mark.parametrize("made", [SOLIDS["bar"], cancelling])
def test_fronts_partition_the_unknowns_and_halves_are_not_adjacent(made):
    """Also if the values of a row beyond the cut cancel."""
    matrix, points = made()
    fronts = dissect(matrix, points)
    assert np.array_equal(np.sort(np.concatenate([f.own for f in fronts])), np.arange(len(points)))
    assert len(fronts) > 1 and max(len(f.own) for f in fronts if not f.children) <= LEAF
    below = []
    for front in fronts:
        inside = [below[child] for child in front.children]
        if inside:
            assert matrix[inside[0]][:, inside[1]].nnz == 0
        below.append(np.concatenate([front.own, *inside]))


def test_the_separator_of_a_cube_has_three_layers_of_functions():
    """As many as a C2 cubic needs between functions that do not overlap."""
    matrix, points = elastic(box((8, 8, 8), space="h2s"))
    root = dissect(matrix, points)[-1].own
    assert len(root) == 3 * 3 * 9 * 9
    assert sorted(len(np.unique(x)) for x in points[root].T) == [3, 9, 9]


def test_single_and_double_precision_are_preserved():
    matrix, points = SOLIDS["bar"]()
    right = np.random.default_rng(5).normal(size=len(points))
    for dtype, error in ((np.float32, 1e-3), (np.float64, 1e-11)):
        factor = factorize(matrix.astype(dtype), points)
        assert factor.below[0].dtype == dtype
        found = factor.solve(right)
        assert found.dtype == np.float64
        assert np.linalg.norm(matrix @ found - right) < error * np.linalg.norm(right)


def test_fill_is_much_smaller_than_the_dense_triangle():
    matrix, points = elastic(box((100, 2, 2), (50.0, 1.0, 1.0), "h2s"))
    found = factorize(matrix, points)
    entries = sum(block.size for block in (*found.diagonal, *found.below))
    assert entries < 0.1 * matrix.shape[0] ** 2


def test_refuses_a_matrix_that_is_not_positive():
    with pytest.raises(ValueError, match="matrix is not positive definite"):
        factorize(csr_matrix(diags([1.0, -1.0, 2.0])))
