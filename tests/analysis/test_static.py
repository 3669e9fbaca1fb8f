"""Elastic statics: constant strain exactly, then beams and a sphere under pressure."""

import numpy as np
import pytest

from polycube.analysis.boundary_sets import faces_of
from polycube.analysis.constraints import Support
from polycube.analysis.problem import MATERIALS, Material
from polycube.analysis.recovery import samples
from polycube.analysis.static import Load, deform, von_mises
from polycube.analysis.supports import prescribed, supports
from polycube.errors import InputError
from tests.conftest import first_quick
from tests.fixtures.hexmeshes import hex_ball, hex_cylinder
from tests.fixtures.splines import box, cube, spline_of, unclamped

GRADIENT = np.array([[0.1, 0.2, 0.0], [-0.3, 0.4, 0.7], [0.5, 0.0, -0.2]]) * 1e-3
SOLID = Material(3.0, 0.3, 2.0)


def stress_of(gradient, material):
    strain = (gradient + gradient.T) / 2
    shear = material.young / (2 * (1 + material.poisson))
    lame = 2 * shear * material.poisson / (1 - 2 * material.poisson)
    return 2 * shear * strain + lame * np.trace(strain) * np.eye(3)


HALF = {"boxes": [{"box": [-1, -1, 0, 0, 1, 0.6]}]}


SOLIDS = {
    "cylinder": lambda: spline_of(hex_cylinder(2, 2, 2), "h2s"),
    "cylinder, optimal, two levels": lambda: spline_of(hex_cylinder(1, 1, 2), refine=HALF),
    "unclamped": lambda: unclamped(2),
    "ball": lambda: spline_of(hex_ball(2), "h2s"),
    "cylinder, optimal": lambda: spline_of(hex_cylinder(1, 1, 2)),
    "cylinder, two levels": lambda: spline_of(hex_cylinder(2, 1, 2), "h2s", refine=HALF),
}


@pytest.fixture(scope="module", params=first_quick(3, SOLIDS))
def spline(request):
    return SOLIDS[request.param]()


def test_patch_test_with_given_displacements(spline):
    every = np.arange(len(spline.sides))
    support = Support("all", every, value=lambda x: x @ GRADIENT.T)
    found = deform(spline, SOLID, [support], length_unit="m", n_gauss=5)
    x, u = (samples(spline, a) for a in (spline.extraction @ spline.control, found.displacement))
    assert u == pytest.approx(x @ GRADIENT.T, abs=1e-12)
    s = stress_of(GRADIENT, SOLID)
    row = [s[0, 0], s[1, 1], s[2, 2], s[1, 2], s[0, 2], s[0, 1]]
    assert found.stress == pytest.approx(np.tile(row, (len(found.stress), 1)), abs=1e-9)
    assert found.von_mises == pytest.approx(np.full(len(found.von_mises), von_mises_of(s)))
    volume = found.mass / SOLID.density
    energy = (s * (GRADIENT + GRADIENT.T) / 2).sum() / 2 * volume
    assert found.strain_energy == pytest.approx(energy, rel=1e-9)
    assert abs(found.reactions).max() < 1e-11


def test_a_bar_held_at_a_face_and_two_edges_is_under_pure_tension():
    """u = (-nu x, -nu y, z) s / E; the supports of the edges carry nothing."""
    spline = box((3, 3, 2), (3.0, 2.0, 1.0))
    held = [{"at": "z_min", "components": ["z"]}]
    for axis in "xy":
        held.append({"at": {"edge": [f"{axis}_min", "z_min"]}, "components": [axis]})
    at = supports(spline, prescribed(held))
    pull = Load(faces_of(spline, "z_max"), traction=(0.0, 0.0, 1e-3))
    found = deform(spline, SOLID, at, [pull], length_unit="m")
    wanted = (spline.extraction @ spline.control) * [-0.3, -0.3, 1] * 1e-3 / 3
    assert found.displacement == pytest.approx(wanted, abs=1e-15)
    assert found.reactions == pytest.approx(np.diag([-6e-3, 0, 0])[:, [1, 2, 0]], abs=1e-15)


def test_a_supported_edge_is_a_singular_place():
    spline = box((4, 2, 2), (4.0, 1.0, 1.0), "h2s")
    held = [{"at": {"edge": [end, "z_min"]}} for end in ("x_min", "x_max")]
    at = supports(spline, prescribed(held))
    push = Load(faces_of(spline, "z_max"), pressure=1e-3)
    found = deform(spline, SOLID, at, [push], length_unit="m")
    assert found.singular.what.startswith("supported edge of x_m")
    assert found.reactions.sum(axis=0) == pytest.approx([0, 0, 4e-3], abs=1e-12)


def von_mises_of(stress):
    deviator = stress - np.trace(stress) / 3 * np.eye(3)
    return np.sqrt(1.5 * (deviator**2).sum())


def test_patch_test_with_given_tractions(spline):
    """Traction of a constant stress on all faces but some, which have the exact displacement."""
    s = stress_of(GRADIENT, SOLID)
    size = np.ptp(spline.control, axis=0)
    low = spline.control.min(axis=0)
    some = faces_of(spline, {"box": [*low, *(low + size * [1, 1, 0.45])]})
    others = np.setdiff1d(np.arange(len(spline.sides)), some)
    found = deform(
        spline,
        SOLID,
        [Support("low", some, value=lambda x: x @ GRADIENT.T)],
        [Load(others, traction=lambda x, n: n @ s)],
        length_unit="m",
        n_gauss=5,
    )
    x, u = (samples(spline, a) for a in (spline.extraction @ spline.control, found.displacement))
    assert u == pytest.approx(x @ GRADIENT.T, abs=2e-6 * abs(u).max())
    assert found.reactions[0] == pytest.approx(-found.load, abs=1e-9 * abs(found.load).max())


def test_uniform_pressure_shrinks_any_solid_uniformly(spline):
    every = np.arange(len(spline.sides))
    bulk = SOLID.young / (3 * (1 - 2 * SOLID.poisson))
    pressure = 3e-3
    exact = -pressure / (3 * bulk)
    some = faces_of(spline, {"box": [*spline.control.min(axis=0), *([1e9] * 3)]})[:3]
    support = Support("some", some, value=lambda x: exact * x)
    found = deform(spline, SOLID, [support], [Load(every, pressure)], length_unit="m", n_gauss=5)
    assert abs(found.load).max() < 1e-12
    x, u = (samples(spline, a) for a in (spline.extraction @ spline.control, found.displacement))
    assert u == pytest.approx(exact * x, abs=2e-6 * abs(u).max())
    assert abs(found.von_mises).max() < 1e-4 * pressure


def test_hanging_bar_under_its_weight():
    """nu = 0: u_z = rho g (z^2 - h^2) / 2 E, exact, for the space has quadratics."""
    spline = cube(2)
    solid = Material(1e6, 0.0, 1000.0)
    top = [Support("z_max", faces_of(spline, "z_max"))]
    found = deform(spline, solid, top, acceleration=(0, 0, -10.0), length_unit="m")
    z = samples(spline, spline.extraction @ spline.control)[..., 2]
    u = samples(spline, found.displacement)
    exact = 1e4 * (z**2 - 1) / 2 / 1e6
    assert u[..., 2] == pytest.approx(exact, abs=1e-12)
    assert samples(spline, found.stress)[..., 2] == pytest.approx(1e4 * z, abs=1e-6)
    assert found.reactions == pytest.approx(np.array([[0, 0, 1e4]]), abs=1e-6)


def test_cantilever_bends_as_a_timoshenko_beam():
    length, height, force = 1.0, 0.1, 7.0
    spline = box((8, 1, 1), (length, height, height))
    solid = Material(1e7, 0.0, 1.0)
    found = deform(
        spline,
        solid,
        [Support("x_min", faces_of(spline, "x_min"))],
        [Load(faces_of(spline, "x_max"), force=(0, 0, -force))],
        length_unit="m",
    )
    inertia, area, shear = height**4 / 12, height**2, solid.young / 2
    bent = force * length**3 / (3 * solid.young * inertia)
    sheared = force * length / (5 / 6 * shear * area)
    x = spline.extraction @ spline.control[:, 0]
    tip = found.displacement[x > length - 1e-9, 2].mean()
    assert tip == pytest.approx(-(bent + sheared), rel=1e-3)
    assert found.strain_energy == pytest.approx(force * (bent + sheared) / 2, rel=1e-3)
    stress = 6 * force * length / height**3
    assert found.von_mises.max() == pytest.approx(stress, rel=0.1)


def test_a_larger_part_is_stiffer_and_less_stressed():
    """A thousand times the length, the same force: 1e-3 of the displacement, 1e-6 of the stress."""
    spline = box((2, 1, 1), (50.0, 20.0, 10.0))
    support = [Support("x_min", faces_of(spline, "x_min"))]
    loads = [Load(faces_of(spline, "x_max"), force=(0, 5.0, 0))]
    in_mm, in_m = (
        deform(spline, MATERIALS["steel"], support, loads, length_unit=unit) for unit in ("mm", "m")
    )
    largest = abs(in_mm.displacement).max()
    assert in_m.displacement == pytest.approx(in_mm.displacement * 1e-6, abs=1e-15 * largest)
    assert in_m.stress == pytest.approx(in_mm.stress * 1e-6, abs=1e-12 * abs(in_mm.stress).max())
    assert in_m.strain_energy == pytest.approx(in_mm.strain_energy * 1e-3)


def test_refuses_a_part_with_free_rigid_motions():
    spline = cube(1)
    with pytest.raises(InputError, match="the supports leave 6 of 6 rigid motions free"):
        deform(spline, SOLID, [])


def test_von_mises_of_pure_states():
    pull, shear, pressure = [5.0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 2.0], [7.0, 7.0, 7.0, 0, 0, 0]
    expected = [5.0, 2 * np.sqrt(3), 0.0]
    assert von_mises(np.array([pull, shear, pressure])) == pytest.approx(expected)
