import logging

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csr_matrix, diags, eye, kron

from polycube.errors import MeshingError
from polycube.numerics.davidson import davidson

SHIFT = -0.01


def cube_of_springs(n):
    """Free lattice of n^3 masses and its exact frequencies squared, most of them several times."""
    line = diags([-np.ones(n - 1), np.r_[1, np.full(n - 2, 2.0), 1], -np.ones(n - 1)], [-1, 0, 1])
    one = eye(n)
    stiffness = kron(kron(line, one), one) + kron(kron(one, line), one) + kron(kron(one, one), line)
    waves = 4 * np.sin(np.pi * np.arange(n) / (2 * n)) ** 2
    exact = (waves[:, None, None] + waves[:, None] + waves).ravel()
    return csr_matrix(stiffness), np.sort(exact)


def inverse(stiffness, mass, dtype=np.float64):
    dense = np.linalg.inv((stiffness - SHIFT * mass).toarray()).astype(dtype)
    return lambda right: (dense @ right.astype(dtype)).astype(np.float64)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_repeated_eigenvalues_of_a_lattice(dtype):
    stiffness, exact = cube_of_springs(9)
    mass = eye(9**3, format="csr")
    values, x = davidson(stiffness, mass, inverse(stiffness, mass, dtype), 20, SHIFT)
    assert values == pytest.approx(exact[:20], abs=1e-12)
    assert x.T @ x == pytest.approx(np.eye(20), abs=1e-12)
    assert stiffness @ x == pytest.approx(x * values, abs=1e-9)


@pytest.mark.parametrize("n_pairs", [1, 5])
def test_dense_answer_with_a_mass_and_through_restarts(n_pairs, caplog):
    """A diagonal preconditioner needs many steps but gives the same result."""
    rng = np.random.default_rng(3)
    parts = rng.normal(size=(2, 80, 80))
    k, m = parts @ parts.swapaxes(1, 2) / 80 + np.diag(np.arange(1.0, 81.0)) / 8
    exact, vectors = eigh(k, m)
    weight = 1 / (np.diag(k) - SHIFT * np.diag(m))[:, None]
    with caplog.at_level(logging.INFO):
        values, x = davidson(
            csr_matrix(k), csr_matrix(m), lambda right: weight * right, n_pairs, SHIFT
        )
    assert caplog.records[-1].args[3] > 8 * max(n_pairs, 4)  # vectors seen: it restarted
    assert values == pytest.approx(exact[:n_pairs], rel=1e-10)
    assert abs(x.T @ m @ vectors[:, :n_pairs]) == pytest.approx(np.eye(n_pairs), abs=1e-6)


def test_stops_at_rounding_errors():
    """Rigid motions of a stiff part next to a soft one: residuals are limited by rounding."""
    line = diags([-np.ones(39), np.r_[1, np.full(38, 2.0), 1], -np.ones(39)], [-1, 0, 1]).toarray()
    stiffness = csr_matrix(np.kron(np.diag([1.0, 1e9]), line))
    mass = eye(80, format="csr")
    values, _ = davidson(stiffness, mass, inverse(stiffness, mass), 5, SHIFT)
    soft = 4 * np.sin(np.pi * np.arange(4) / 80) ** 2
    assert values == pytest.approx(np.sort(np.r_[0, soft]), abs=1e-6)


def test_reports_that_it_has_not_converged(monkeypatch):
    monkeypatch.setattr("polycube.numerics.davidson.ITERATIONS", 3)
    stiffness, _ = cube_of_springs(9)
    with pytest.raises(MeshingError, match="did not converge in 3 iterations: residual"):
        davidson(stiffness, eye(9**3, format="csr"), np.copy, 2, SHIFT)
