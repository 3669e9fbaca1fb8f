"""Orders of convergence in the optimal space, for exact eigenvalues and functions."""

import numpy as np
import pytest
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from polycube.registry import build
from polycube.spline.bernstein import bernstein, tensor
from polycube.spline.spaces.refinement import refined_spline
from polycube.spline.spaces.selection import Refinement
from tests.fixtures.hexmeshes import hex_ball, hex_box, hex_cylinder, pillowed_cube
from tests.fixtures.hierarchies import space_on
from tests.oracles.matrices import assemble_scalar

SOLIDS = {
    "box": hex_box((3, 1, 4)),
    "cylinder": hex_cylinder(2, 2, 3),
    "ball": hex_ball(2),
    "lines": pillowed_cube(2),
    "points": pillowed_cube(3),
}


def space_of(mesh, kind="optimal", **options):
    plugin = build("spline", {"plugin": kind, **options})
    return space_on(plugin, mesh)


def poisson_errors(mesh, kind, levels, exact):
    """Relative errors of the first Laplace eigenvalue of the unit cube, insulated, by level."""
    space = space_of(mesh, kind)
    errors = []
    for level in levels:
        stiffness, mass = assemble_scalar(refined_spline(space, Refinement(levels=level), None))
        found = np.sort(lowest(stiffness, mass, 1 + len(exact)))
        errors.append(abs(found[1:] / exact - 1).max())
    return np.array(errors)


def lowest(stiffness, mass, count):
    symmetric = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0}
    factor = splu((stiffness + mass).tocsc(), **symmetric, options={"SymmetricMode": True})
    inverse = LinearOperator(stiffness.shape, factor.solve, dtype=float)
    start = np.random.default_rng(0).normal(size=stiffness.shape[0])  # unseeded, it missed a copy
    return eigsh(stiffness, count, mass, sigma=-1.0, OPinv=inverse, v0=start, ncv=40)[0]


NEUMANN = np.pi**2 * np.array([1, 1, 1, 2, 2, 2])


@pytest.mark.slow
def test_eigenvalues_of_a_box_converge_with_the_sixth_power():
    rates = {}
    for kind, n in (("h2s", 4), ("optimal", 4), ("c0", 2)):
        errors = poisson_errors(hex_box((n, n, n)), kind, (0, 1), NEUMANN[:3])
        rates[kind] = np.log2(errors[0] / errors[1])
    assert rates == pytest.approx({"h2s": 3, "optimal": 6, "c0": 6}, abs=0.3)


@pytest.mark.parametrize("name", ["points"])
def test_order_of_eigenvalues_at_extraordinary_edges(name):
    errors = poisson_errors(SOLIDS[name], "optimal", (0, 1), NEUMANN)
    assert errors[1] < 3e-6
    assert np.log2(errors[0] / errors[1]) > 4.7


@pytest.mark.slow
@pytest.mark.parametrize("name", ["lines", "points"])
def test_orders_at_extraordinary_edges(name):
    plain = poisson_errors(SOLIDS[name], "h2s", (1, 2), NEUMANN)
    optimal = poisson_errors(SOLIDS[name], "optimal", (1, 2), NEUMANN)
    assert np.log2(plain[0] / plain[1]) == pytest.approx(3, abs=0.2)
    assert np.log2(optimal[0] / optimal[1]) > 5.7


def test_projection_converges_with_the_fourth_power():
    def error(n):
        space = space_of(hex_box((n, n, n)))
        line = np.linspace(0, 1, 5)
        basis = tensor(*[bernstein(line)] * 3)
        rows = np.concatenate([basis @ space.extraction[nodes].toarray() for nodes in space.nodes])
        x = rows @ space.control
        wave = np.cos(3 * x).prod(axis=1)
        best = np.linalg.lstsq(rows, wave, rcond=None)[0]
        return np.sqrt(((rows @ best - wave) ** 2).mean())

    assert np.log2(error(2) / error(4)) == pytest.approx(4, abs=0.3)
