"""Hexes that are inverted inside although their corners are not."""

import numpy as np
import pytest

from polycube.fitting import energy
from polycube.fitting.cures.cure import cure
from polycube.fitting.cures.fitted import certified_jacobian, halved_energy
from polycube.fitting.energy import Terms
from polycube.fitting.problem import FitProblem
from polycube.fitting.springs import NO_SPRINGS
from polycube.hexmesh.certificate import certify
from polycube.hexmesh.connectivity import PLACES, hex_mesh
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.surface.fit_target import target
from tests.fixtures.hexmeshes import unit_cubes
from tests.fixtures.surfaces import box

TERMS = Terms(jacobian=1.0, beta=5.0)
ONE = np.arange(8)[None]
# positive at its corners, negative near one of its edges
HIDDEN = np.array(
    [[1, 0, 2], [2, -2, -2], [3, 2, -1], [2, 2, -1], [2, 1, 6], [5, 0, 5], [5, 4, 4], [-2, 3, 2]],
    float,
)


def with_a_hidden_inversion():
    """A block of hexes that gives way to the hidden inversion in its middle, and its surface."""
    vertices, cubes = unit_cubes(11, 11, 11)
    middle, surface = cubes[len(cubes) // 2], box(high=(11, 11, 11))
    u, sizes, w = np.linalg.svd((HIDDEN - HIDDEN.mean(axis=0)).T @ (PLACES - 0.5))
    assert np.linalg.det(u @ w) > 0 and sizes.min() > 0  # turned towards the axes of the lattice
    vertices[middle] = vertices[middle].mean(axis=0) + 0.4 * (HIDDEN - HIDDEN.mean(axis=0)) @ u @ w
    problem = FitProblem(hex_mesh(vertices, cubes), target(surface), samples=1)
    moves = np.ones(len(vertices), bool)
    moves[middle] = moves[problem.outer] = False
    wanted, springs = np.ones((len(cubes), 3)), [NO_SPRINGS]
    return hex_mesh(problem.relax(vertices, wanted, Terms(), springs, 300, moves), cubes), surface


def test_a_clearly_positive_hex_is_not_halved():
    x, lengths = 2.0 * PLACES, np.full((1, 3), 2.0)
    found = halved_energy(x, ONE, lengths, TERMS)(x)
    wanted = energy.energy(x, ONE, lengths, TERMS, NO_SPRINGS)
    assert found[0] == wanted[0] and np.array_equal(found[1], wanted[1])


def test_the_energy_of_halves_is_that_of_eight_hexes_between_mid_points():
    lengths = np.full((1, 3), 4.0)
    found, _ = halved_energy(HIDDEN, ONE, lengths, TERMS)(HIDDEN)
    wanted, _ = energy.energy(HIDDEN, ONE, lengths, TERMS, NO_SPRINGS)
    for corner in PLACES:  # each half is the image of a small cube
        at = (corner + PLACES) / 2
        weights = np.where(PLACES, at[:, None], 1 - at[:, None]).prod(axis=2)
        wanted += energy.energy(weights @ HIDDEN, ONE, lengths / 2, TERMS, NO_SPRINGS)[0]
    assert found == pytest.approx(wanted, rel=1e-9)


def test_the_gradient_is_that_of_the_energy():
    function = halved_energy(HIDDEN, ONE, np.full((1, 3), 4.0), TERMS)
    along = np.random.default_rng(1).normal(size=HIDDEN.shape)
    high, low = (function(HIDDEN + step * along)[0] for step in (1e-6, -1e-6))
    assert (function(HIDDEN)[1] * along).sum() == pytest.approx((high - low) / 2e-6, rel=1e-5)


def test_a_hidden_inversion_has_no_positive_scaled_jacobian():
    assert scaled_jacobian(HIDDEN, ONE)[0] > 0.3
    assert certified_jacobian(HIDDEN, ONE)[0] == 0
    assert certified_jacobian(1.0 * PLACES, ONE)[0] == 1


def test_a_hidden_inversion_is_cured():
    mesh, surface = with_a_hidden_inversion()
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0.2
    assert (~certify(mesh.vertices, mesh.hexes).positive).sum() == 1
    found = cure(mesh, target(surface), 0.2, 0.002)  # by scaled Jacobians, no hex is poor
    assert certify(found.vertices, found.hexes).positive.all()
    assert scaled_jacobian(found.vertices, found.hexes).min() > 0.2
