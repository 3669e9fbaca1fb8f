"""-div k grad u = f: polynomials exactly, rates, spectra of the unit cube."""

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from polycube.analysis.boundary_sets import faces_of
from polycube.analysis.constraints import Support, constrain
from polycube.analysis.modal import lowest
from polycube.analysis.poisson import conduct
from polycube.analysis.problem import Flow
from polycube.analysis.recovery import samples
from polycube.hexmesh.named_sets import ENDS
from tests.conftest import first_quick
from tests.fixtures.hexmeshes import hex_ball, hex_cylinder
from tests.fixtures.splines import cube, spline_of, unclamped
from tests.oracles.integrals import coefficients, integrate
from tests.oracles.matrices import assemble_scalar

DIRICHLET = np.pi**2 * np.array([3, 6, 6, 6, 9, 9, 9, 11, 11, 11])
NEUMANN = np.pi**2 * np.array([0, 1, 1, 1, 2, 2, 2, 3])
SPACES = {
    "optimal": lambda: cube(2),
    "c0": lambda: cube(1, "c0"),
    "unclamped": lambda: unclamped(2),
}


def places(spline):
    return samples(spline, spline.extraction @ spline.control).reshape(-1, 3)


def values(spline, found):
    return samples(spline, (spline.extraction @ found.values)[:, None]).ravel()


def all_around(spline, value):
    return [Support("all", np.arange(len(spline.sides)), (0,), value)]


@pytest.mark.slow
@pytest.mark.parametrize("space", ["h2s", "optimal"])
@pytest.mark.parametrize("mesh", [hex_ball(2), hex_cylinder(2, 2, 2)], ids=["ball", "cylinder"])
def test_patch_test_on_an_unstructured_mesh(mesh, space):
    spline = spline_of(mesh, space)
    slope = np.array([1.0, -2.0, 0.5])
    found = conduct(
        spline, 3.0, all_around(spline, lambda x: x @ slope), length_unit="m", n_gauss=5
    )
    assert values(spline, found) == pytest.approx(places(spline) @ slope, abs=1e-9)
    assert found.flux == pytest.approx(np.tile(-3 * slope, (len(found.flux), 1)), abs=1e-7)
    assert found.flows == pytest.approx([0.0], abs=1e-9)


@pytest.mark.parametrize("space", SPACES)
def test_cubic_polynomials_in_the_space_are_exact(space):
    spline = SPACES[space]()

    def u(x):
        return x[:, 0] ** 3 - 2 * x[:, 1] * x[:, 2] ** 2 + x[:, 0] * x[:, 1]

    def source(x):
        return -2 * (6 * x[:, 0] - 4 * x[:, 1])

    supplied = coefficients(spline, source)
    found = conduct(spline, 2.0, all_around(spline, u), source=supplied, length_unit="m")
    assert values(spline, found) == pytest.approx(u(places(spline)), abs=1e-8)
    assert found.supplied == pytest.approx(-2.0)
    assert found.flows == pytest.approx([2.0])


def test_given_flux_and_source_of_a_slab():
    """-(k u')' = f, u(0) = 0, k u'(1) = q: u = (q + f) x / k - f x^2 / 2 k; metres and mm."""
    spline = cube(2)
    found = conduct(
        spline,
        4.0,
        [Support("x_min", faces_of(spline, "x_min"), (0,))],
        [Flow(faces_of(spline, "x_max"), 3e3)],
        source=2e6,
    )
    x = places(spline)[:, 0] * 1e-3
    exact = (3e3 + 2e6 * 1e-3) * x / 4 - 2e6 * x**2 / 8
    assert values(spline, found) == pytest.approx(exact, abs=1e-9)
    assert found.supplied == pytest.approx(3e3 * 1e-6 + 2e6 * 1e-9)
    assert found.flows == pytest.approx([-found.supplied])


def errors(spline):
    """L2 and H1 of the solution sin pi x sin pi y sin pi z + x, u given on x, flux elsewhere.

    Third, the estimated error in H1.
    """
    wave = np.pi

    def u(x):
        return np.prod(np.sin(wave * x + 0.4), axis=-1)

    def slope(x):
        s, c = np.sin(wave * x + 0.4), np.cos(wave * x + 0.4)
        return wave * np.stack(
            [
                c[..., 0] * s[..., 1] * s[..., 2],
                s[..., 0] * c[..., 1] * s[..., 2],
                s[..., 0] * s[..., 1] * c[..., 2],
            ],
            -1,
        )

    sides = np.concatenate([faces_of(spline, end) for end in ENDS[2:]])
    ends = np.setdiff1d(np.arange(len(spline.sides)), sides)
    found = conduct(
        spline,
        1.0,
        [Support("x", ends, (0,), u)],
        [Flow(sides, lambda x, n: (slope(x) * n).sum(axis=1))],
        source=coefficients(spline, lambda x: 3 * wave**2 * u(x), 5),
        length_unit="m",
        n_gauss=5,
    )
    functions = spline.element_functions()
    padded = np.append(found.values, 0)
    square = np.zeros(3)
    for chunk in integrate(spline, functions, 5):
        local = padded[chunk.functions]
        off = np.einsum("efq,ef->eq", chunk.shape, local) - u(chunk.points) * chunk.root
        tilt = np.einsum("eqfi,ef->eqi", chunk.slope, local)
        square += [
            (off**2).sum(),
            ((tilt - slope(chunk.points) * chunk.root[..., None]) ** 2).sum(),
            found.flux_error**2 * (tilt**2).sum(),
        ]
    return np.sqrt(square)


@pytest.mark.slow
def test_rates_of_a_manufactured_solution():
    coarse, fine = (errors(cube(n)) for n in (4, 8))
    assert np.log2(coarse / fine) == pytest.approx([4.0, 3.0, 3.0], abs=0.3)
    assert fine[0] < 2e-5
    assert fine[1] == pytest.approx(fine[2], rel=0.2)


@pytest.mark.slow
def test_natural_boundary_of_h2s_reduces_the_order():
    coarse, fine = (errors(cube(n, "h2s")) for n in (3, 6))
    rates = np.log2(coarse / fine)
    assert rates[0] == pytest.approx(2.5, abs=0.4) and rates[1] == pytest.approx(1.5, abs=0.4)


def spectrum(spline, is_held, count):
    stiffness, mass = assemble_scalar(spline)
    if is_held:
        basis = constrain(spline, all_around(spline, 0.0), 1).basis
        stiffness, mass = (csr_matrix(basis.T @ a @ basis) for a in (stiffness, mass))
    return lowest(stiffness, mass, count)[0]


@pytest.mark.parametrize("build", first_quick(1, [cube, unclamped]))
def test_spectra_of_the_unit_cube(build):
    assert spectrum(build(5), True, 10) == pytest.approx(DIRICHLET, rel=3e-3)
    found = spectrum(build(4), False, 8)
    assert found == pytest.approx(NEUMANN, rel=4e-4, abs=1e-9)
    assert found[1:4] == pytest.approx(NEUMANN[1:4], rel=1e-5)


@pytest.mark.slow
def test_eigenvalues_converge_with_the_sixth_power():
    for is_held, exact in ((True, DIRICHLET[0]), (False, NEUMANN[1])):
        off = [spectrum(cube(n), is_held, 2)[0 if is_held else 1] / exact - 1 for n in (3, 6)]
        assert np.log2(off[0] / off[1]) == pytest.approx(6, abs=0.4)


def test_natural_boundary_of_h2s_in_the_spectrum():
    off = [spectrum(cube(n, "h2s"), False, 2)[1] / NEUMANN[1] - 1 for n in (3, 6)]
    assert np.log2(off[0] / off[1]) == pytest.approx(3, abs=0.2)
