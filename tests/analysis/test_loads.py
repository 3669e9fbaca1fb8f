"""Loads as tractions: resultants, distributions, and the problems that they lead to."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.analysis.boundary_sets import faces_of, trace
from polycube.analysis.constraints import Support
from polycube.analysis.loads import Load, at_points, check_expression
from polycube.analysis.problem import Material, Rotation
from polycube.analysis.recovery import samples
from polycube.analysis.static import deform
from polycube.errors import InputError
from tests.fixtures.hexmeshes import hex_cylinder
from tests.fixtures.splines import box, cube, spline_of

STEEL = Material(210e9, 0.3, 7850, 12e-6)
VECTOR = st.tuples(*[st.floats(-10, 10)] * 3)


def resultants(load, points, normals, area, metre):
    """Force, and moment about the origin."""
    force = load.traction_at(points, normals, area, metre) * (metre**2 * area)[:, None]
    return force.sum(axis=0), np.cross(metre * points, force).sum(axis=0)


@settings(max_examples=30, deadline=None)
@given(VECTOR, VECTOR, VECTOR, st.integers(0, 2**32 - 1))
def test_force_and_moment_have_their_resultants_about_any_point(force, moment, point, seed):
    rng = np.random.default_rng(seed)
    points, area, metre = rng.normal(size=(40, 3)), rng.uniform(0.1, 1, 40), 1e-3
    load = Load(None, force=force, moment=moment, point=point)
    total, turning = resultants(load, points, points, area, metre)
    arm = np.cross(metre * np.array(point), force)
    assert total == pytest.approx(np.array(force), abs=1e-9)
    assert turning == pytest.approx(np.array(moment) + arm, abs=1e-9)


def test_a_bearing_load_has_its_resultant_and_presses_on_one_half():
    spline = spline_of(hex_cylinder(2, 2, 2))
    here = trace(spline, np.arange(len(spline.sides)))
    side = abs(here.normals[:, 2]) < 0.1
    points, normals, area = here.points[side], here.normals[side], here.area[side]
    load = Load(None, bearing=(300.0, 400.0, 0.0))
    total, _ = resultants(load, points, normals, area, 1.0)
    assert total == pytest.approx([300, 400, 0], abs=1)
    traction, pulled = load.traction_at(points, normals, area, 1.0), normals @ [0.6, 0.8, 0] >= 0
    assert not traction[pulled].any() and traction[~pulled].any(axis=1).all()


def test_a_bearing_load_that_pulls_is_refused():
    with pytest.raises(InputError, match="pulls at all of its faces"):
        Load(None, bearing=(1.0, 0, 0)).traction_at(
            np.eye(3), np.eye(3)[[0, 0, 0]], np.ones(3), 1.0
        )


def test_expressions_are_evaluated_at_points():
    points = np.array([[3.0, 4, 1], [0, 2, 5]])
    assert at_points("sqrt(x**2 + y**2) + z", points) == pytest.approx([6, 7])
    assert at_points("where(z > 2, 1, 0) * pi", points) == pytest.approx([0, np.pi])
    assert at_points(2, points) == pytest.approx([2, 2])


@pytest.mark.parametrize(
    "given",
    [
        *("x +", "q", "x.real", "[x]", "__import__('os')", "lambda: x", "'a'", "x(3)", "sqrt"),
        *("1 / 0", True, [1], None),
    ],
)
def test_other_expressions_are_refused(given):
    with pytest.raises(ValueError, match="an expression of x, y, z"):
        check_expression("pressure", given)


def test_an_expression_without_a_finite_value_is_refused_with_the_place():
    check_expression("pressure", "sqrt(x - 2)")
    assert at_points("sqrt(x - 2)", np.array([[3.0, 0, 0]])) == pytest.approx([1])
    with pytest.raises(InputError, match=r"no finite value at .1\. 5\. 6\.\]"):
        at_points("sqrt(x - 2)", np.array([[3.0, 0, 0], [1, 5, 6]]))


def test_water_lifts_a_block_by_its_weight():
    """Hydrostatic pressure on all faces is the weight of the displaced water."""
    spline = cube(2)
    every = np.arange(len(spline.sides))
    here = trace(spline, every)
    load = Load(None, pressure="1000 * 9.81 * (1 - z)")
    force, _ = resultants(load, here.points, here.normals, here.area, 1.0)
    volume = np.prod(np.ptp(spline.control, axis=0))
    assert force == pytest.approx([0, 0, 1000 * 9.81 * volume], abs=1e-8)


@pytest.fixture(scope="module")
def bar():
    """10 x 1 x 1, along x."""
    return box((4, 1, 1), (10, 1, 1))


SLIDING = ("x_min", 0), ("y_min", 1), ("z_min", 2)


def sliding(spline):
    return [Support(name, faces_of(spline, name), (axis,)) for name, axis in SLIDING]


def test_a_moment_bends_a_bar_to_a_circle(bar):
    """Pure bending, whose displacement is quadratic without Poisson's ratio."""
    fixed = Support("end", faces_of(bar, "x_min"))
    load = Load("x_max", moment=(0, 0, 10.0))
    found = deform(bar, Material(210e9, 0.0, 1.0), [fixed], [load], length_unit="m")
    bend = 10.0 / (210e9 / 12)
    u, x = (samples(bar, a) for a in (found.displacement, bar.extraction @ bar.control))
    assert u[..., 1] == pytest.approx(bend * x[..., 0] ** 2 / 2, abs=1e-9 * bend)
    assert found.strain_energy == pytest.approx(10.0 * bend * 10 / 2, rel=1e-9)
    assert found.load == pytest.approx(np.zeros(3), abs=1e-9)


def test_a_rotating_bar_is_stretched_as_in_one_dimension(bar):
    """sigma = rho omega^2 (L^2 - x^2) / 2 for a bar without Poisson effect."""
    turning = Rotation((0, 0, 1), rpm=3000, point=(0, 0.5, 0.5))
    found = deform(bar, Material(210e9, 0.0, 7850), sliding(bar), length_unit="m", rotation=turning)
    x = samples(bar, bar.extraction @ bar.control)[..., 0]
    stress = samples(bar, found.stress)[..., 0]
    speed = 100 * np.pi
    exact = 7850 * speed**2 * (100 - x**2) / 2
    assert stress == pytest.approx(exact, abs=2e-3 * exact.max())
    assert found.load[0] == pytest.approx(7850 * speed**2 * 50, rel=1e-9)
    assert -found.reactions[0][0] == pytest.approx(7850 * speed**2 * 50, rel=1e-6)


def test_a_free_part_expands_without_stress(bar):
    found = deform(bar, STEEL, sliding(bar), length_unit="mm", temperature=100.0)
    points = bar.extraction @ bar.control
    assert found.displacement == pytest.approx(points * 12e-4, abs=1e-12)
    assert abs(found.stress).max() < 1.0
    assert abs(found.strain_energy) < 1e-9


def test_a_temperature_that_is_linear_in_space_gives_no_stress(bar):
    """Its strain is compatible: u = a c ((x^2 - y^2 - z^2) / 2, x y, x z) for T = c x."""

    def exact(p):
        x, y, z = p.T
        return 12e-6 * 5 * np.stack([(x**2 - y**2 - z**2) / 2, x * y, x * z], axis=1)

    moved = Support("all", np.arange(len(bar.sides)), value=exact)
    found = deform(bar, STEEL, [moved], length_unit="m", temperature="5 * x")
    u, x = (samples(bar, a) for a in (found.displacement, bar.extraction @ bar.control))
    assert u == pytest.approx(exact(x.reshape(-1, 3)).reshape(u.shape), abs=1e-12)
    assert abs(found.stress).max() < 1e-7 * 210e9 * 12e-6 * 50
    assert found.strain_energy == pytest.approx(0, abs=1e-9)


def test_a_clamped_part_has_the_stress_of_its_temperature(bar):
    every = Support("all", np.arange(len(bar.sides)))
    found = deform(bar, STEEL, [every], length_unit="mm", temperature=100.0)
    pressure = 210e9 * 12e-6 * 100 / (1 - 2 * 0.3)
    exact = np.tile([-pressure] * 3 + [0] * 3, (len(found.stress), 1))
    assert found.stress == pytest.approx(exact, abs=1e-6 * pressure)
    volume = 10e-9
    assert found.strain_energy == pytest.approx(3 * pressure * 12e-4 / 2 * volume, rel=1e-9)
