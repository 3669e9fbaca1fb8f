"""Stress recovery in continuous functions: polynomials, a direct solution, Lame's solution."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import eye, kron
from scipy.sparse.linalg import spsolve

from polycube.analysis.assembly import Elements, assemble_lower
from polycube.analysis.boundary_sets import trace
from polycube.analysis.constraints import Support
from polycube.analysis.continuous import FROM_LOBATTO, Elasticity, Enrichment
from polycube.analysis.problem import Material
from polycube.analysis.recovery import EVEN, at_places, barlow, samples
from polycube.analysis.static import Load, deform, von_mises
from polycube.spline.bernstein import gauss, tensor
from polycube.types import Spline
from tests.fixtures.hexmeshes import hex_cylinder
from tests.fixtures.splines import box, spline_of

SOLID = Material(3.0, 0.3, 2.0)
SPACES = ("h2s", "optimal", "c0")


def points_of(spline):
    return samples(spline, spline.extraction @ spline.control).reshape(-1, 3)


def sides_where(spline, of):
    """Numbers of the boundary faces that are, on average over points (P, 3), where `of` is 0."""
    each = [trace(spline, np.array([k])).points for k in range(len(spline.sides))]
    return np.array([k for k, x in enumerate(each) if abs(of(x)).mean() < 1e-2])


@pytest.mark.parametrize(("space", "nu"), [("h2s", 0.0), ("optimal", 0.3), ("c0", 0.3)])
def test_pure_bending_is_exact(space, nu):
    """sigma_xx = E c z and nothing else; `h2s` does not have the x^2, which the correction adds."""
    spline = box((4, 2, 2), (2.0, 1.0, 1.0), space)
    c = 1e-3

    def bent(x):
        x, y, z = x.T
        return c * np.stack([x * z, -nu * y * z, -(x**2) / 2 - nu * (z**2 - y**2) / 2], axis=1)

    def pull(x, normal):
        return c * (x[:, 2] * normal[:, 0])[:, None] * [1, 0, 0]

    ends = [sides_where(spline, lambda x, end=end: x[:, 0] - end) for end in (0, 2)]
    support, load = Support("x_min", ends[0], value=bent), Load(ends[1], traction=pull)
    found = deform(spline, Material(1.0, nu, 1.0), [support], [load], length_unit="m")
    exact = np.zeros((len(points_of(spline)), 6))
    exact[:, 0] = c * points_of(spline)[:, 2]
    off = abs(samples(spline, found.stress).reshape(-1, 6) - exact).max()
    assert off < c * (2e-3 if space == "h2s" else 1e-8)


@pytest.mark.parametrize("space", SPACES[:2])
def test_it_is_the_solution_in_all_continuous_functions(space):
    spline = spline_of(hex_cylinder(1, 1, 2), space)
    points = spline.extraction @ spline.control
    nodal = replace(spline, control=points, extraction=eye(len(points), format="csr"))
    low, high = (
        sides_where(spline, lambda x, end=end: x[:, 2] - end)
        for end in (points[:, 2].min(), points[:, 2].max())
    )
    load = Load(high, traction=(0.3, 0.0, 1.0))
    found, direct = (
        deform(s, SOLID, [Support("foot", low)], [load], length_unit="m") for s in (spline, nodal)
    )
    size = abs(direct.stress).max()
    assert found.stress == pytest.approx(direct.stress, abs=2e-3 * size)
    assert found.peak.at == pytest.approx(direct.peak.at)
    largest = abs(direct.displacement).max()
    assert found.displacement == pytest.approx(direct.displacement, abs=1e-3 * largest)
    assert found.strain_energy == pytest.approx(direct.strain_energy, rel=1e-4)
    assert found.reactions == pytest.approx(direct.reactions, rel=0.05, abs=1e-3)


def quarter_ring(n: int, space: str, outer: float) -> Spline:
    """A ring between radii 1 and outer, fitted to the exact circles in all control points."""
    spline = box((n, n, 1), (1.0, 1.0, 0.5), space)
    flat = (EVEN @ (spline.extraction @ spline.control)[spline.nodes]).reshape(-1, 3)
    radius, angle = 1 + (outer - 1) * flat[:, 0], np.pi / 2 * flat[:, 1]
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle), flat[:, 2]], axis=1)
    own = eye(spline.extraction.shape[0], format="csr")[spline.nodes.ravel()]
    at = kron(eye(len(spline.nodes)), EVEN, "csr") @ own @ spline.extraction
    return replace(spline, control=spsolve((at.T @ at).tocsc(), at.T @ ring))


def pressed(n, space, outer=2.0):
    """The ring under internal unit pressure in plane strain, and the stress of Lame's solution."""
    spline = quarter_ring(n, space, outer)
    inner = sides_where(spline, lambda x: np.hypot(x[:, 0], x[:, 1]) - 1)
    flat = [
        Support("y", sides_where(spline, lambda x: x[:, 1]), (1,)),
        Support("x", sides_where(spline, lambda x: x[:, 0]), (0,)),
        Support("z", sides_where(spline, lambda x: x[:, 2] * (x[:, 2] - 0.5)), (2,)),
    ]
    found = deform(spline, Material(1.0, 0.3, 1.0), flat, [Load(inner, 1.0)], length_unit="m")
    x, y, _ = points_of(spline).T
    square, rest = x**2 + y**2, outer**2 - 1
    radial, hoop = (1 - outer**2 / square) / rest, (1 + outer**2 / square) / rest
    exact = np.zeros((len(x), 6))
    exact[:, 0] = (radial * x**2 + hoop * y**2) / square
    exact[:, 1] = (radial * y**2 + hoop * x**2) / square
    exact[:, 2] = 0.3 * (radial + hoop)
    exact[:, 5] = (radial - hoop) * x * y / square
    return found, samples(spline, found.stress).reshape(-1, 6), exact


@pytest.mark.parametrize("space", SPACES[1:])
def test_thick_ring_under_pressure_converges_to_lame(space):
    off = []
    for n in (2, 4):
        found, stress, exact = pressed(n, space)
        off.append(np.sqrt(((stress - exact) ** 2).mean() / (exact**2).mean()))
    assert off[1] < 3e-3 and off[0] / off[1] > 6  # 2^3, nearly
    assert 0.5 * off[1] < found.stress_error < 2 * off[1]
    hoop, radial = 5 / 3, -1.0
    along = 0.3 * (hoop + radial)
    exact = np.sqrt(((hoop - radial) ** 2 + (radial - along) ** 2 + (along - hoop) ** 2) / 2)
    assert abs(found.peak.value - exact) < found.peak.error < 0.02 * exact
    assert found.peak.value == pytest.approx(exact, rel=4e-3)
    assert np.hypot(*found.peak.at[:2]) == pytest.approx(1, abs=1e-3)
    assert found.singular is None and found.poor == 0


@pytest.mark.parametrize("outer", [3.0, 4.0])
def test_the_largest_stress_is_within_its_estimate_where_it_falls_steeply(outer):
    found, _, exact = pressed(3, "optimal", outer)
    largest = von_mises(exact).max()
    assert abs(found.peak.value - largest) < found.peak.error < 0.08 * largest


@pytest.mark.parametrize("counts", [(5, 2, 2), (13, 5, 3)])
def test_forces_and_stresses_of_elements_are_those_of_the_matrix_and_of_the_gradient(counts):
    """Of bent elements of two materials, not a multiple of a batch, in one and in three parts."""
    spline, n = box(counts, (2.0, 1.0, 1.0), "c0"), int(np.prod(counts))
    x, y, z = spline.control.T
    spline = replace(spline, control=np.column_stack([x + 0.2 * y * z, y + 0.1 * x**2, z]))
    solid = Material.of_elements([SOLID, Material(1.0, 0.2, 1.0)], np.arange(n) % 2)
    u = np.random.default_rng(1).normal(size=spline.control.shape)
    moved, elasticity = spline.extraction @ u, Elasticity.of(spline, solid)
    assert len(elasticity.sums.further) == max(1, n // 64)
    stress = np.empty((n, 64, 6), np.float32)
    forces = spline.extraction.T @ elasticity.forces(moved, stress=stress)
    matrix = assemble_lower(Elements.of(spline), solid)[0].full()
    assert forces.ravel() == pytest.approx(matrix @ u.ravel(), abs=1e-9)
    exact = at_places(spline, moved, solid.stress, gauss(4)[0])
    exact *= np.sqrt(elasticity.volume)[..., None]
    assert stress == pytest.approx(exact, abs=1e-6 * abs(exact).max())


def test_single_precision_changes_a_correction_by_rounding_errors_only():
    spline = spline_of(hex_cylinder(2, 2, 4), "h2s")
    elasticity = Elasticity.of(spline, SOLID)
    rest = np.random.default_rng(3).normal(size=(spline.extraction.shape[0], 3))
    double, single = (
        Enrichment.of(spline, elasticity, [], kind=kind).solve(rest, 10, 0.0)[0]
        for kind in (np.float64, np.float32)
    )
    assert abs(single - double).max() < 1e-4 * abs(double).max()


def test_energies_of_functions_of_lobatto_points_are_exact_in_straight_elements():
    spline = box((2, 1, 1), (2.0, 1.0, 0.5), "c0")
    elasticity = Elasticity.of(spline, SOLID)
    alone = np.zeros(spline.extraction.shape[0])
    alone[spline.nodes[0, 21]] = 1  # of one element only
    one = (FROM_LOBATTO @ alone[spline.nodes[0]])[:, None] * np.eye(3)[1]
    moved = np.zeros((len(alone), 3))
    moved[spline.nodes[0]] = one
    energy = (moved * elasticity.forces(moved)).sum()
    assert elasticity.diagonal()[spline.nodes[0, 21], 1] == pytest.approx(energy, rel=1e-12)


def test_a_triquadratic_stress_is_carried_from_all_numbers_of_gauss_points():
    def field(line):
        return np.polynomial.polynomial.polyvander(line, 2)

    factor = np.random.default_rng(2).normal(size=27)
    for n in (4, 5):
        table = tensor(*[field(gauss(n)[0])] * 3) @ factor
        even = tensor(*[field(np.arange(4) / 3)] * 3) @ factor
        assert EVEN @ barlow(n) @ table == pytest.approx(even)
