"""Models with at least `preconditioner.LIMIT` functions: the results of the direct solver."""

import logging

import numpy as np
import pytest

from polycube.analysis import preconditioner
from polycube.analysis.boundary_sets import faces_of
from polycube.analysis.constraints import Support
from polycube.analysis.modal import free_modes
from polycube.analysis.poisson import conduct
from polycube.analysis.preconditioner import LEAST, VertexModel
from polycube.analysis.problem import MATERIALS, Cyclic
from polycube.analysis.static import Load, deform
from tests.conftest import first_quick
from tests.fixtures.hexmeshes import hex_ball, hex_box, hex_cylinder
from tests.fixtures.splines import cube, spline_of

STEEL = MATERIALS["steel"]


@pytest.fixture
def limits(monkeypatch):
    """A function that sets limits of the iterative solver."""

    def set_to(**values):
        for name, value in values.items():
            monkeypatch.setattr(preconditioner, name, value)

    return set_to


def both(limits, solve, **values):
    """Results of a function with the direct and with the iterative solver."""
    direct = solve()
    limits(**(values or {"LIMIT": 0}))
    return direct, solve()


@pytest.mark.parametrize("steps", [60, 0])
def test_a_factor_in_single_precision_is_corrected_or_replaced(limits, steps):
    """Without steps, the factor in double precision replaces it."""
    beam = spline_of(hex_box((6, 2, 1), (6.0, 1.0, 0.4)))
    held = [Support("x_min", faces_of(beam, "x_min"))]
    pull = [Load(faces_of(beam, "x_max"), force=(0, 0, 1.0))]
    direct, other = both(limits, lambda: deform(beam, STEEL, held, pull), SMALL=0, FEW=steps)
    assert other.reactions == pytest.approx(direct.reactions, rel=1e-6, abs=1e-6)
    largest = abs(direct.displacement).max()
    assert other.displacement == pytest.approx(direct.displacement, abs=1e-4 * largest)
    assert other.strain_energy == pytest.approx(direct.strain_energy, rel=1e-4)


CLOSED = [hex_box((5, 4, 3)), hex_cylinder(2, 2, 2), hex_ball(2)]


@pytest.mark.parametrize("mesh", first_quick(2, CLOSED))
def test_mean_at_vertices_has_its_eigenvalues_between_a_27th_and_one(mesh):
    spline = spline_of(mesh, "h2s")
    model = VertexModel.of(spline)
    values = np.linalg.eigvals(model.values.toarray())
    assert abs(values.imag).max() < 1e-6
    assert LEAST < values.real.min() and values.real.max() == pytest.approx(1)
    assert model.values @ np.ones(len(spline.control)) == pytest.approx(1)


def test_functions_without_vertices_have_no_vertex_model():
    assert VertexModel.of(cube(3, "h2s")) is not None
    assert VertexModel.of(cube(3, "optimal")) is None
    assert VertexModel.of(cube(3, "c0")) is None


@pytest.mark.slow
@pytest.mark.parametrize("is_clamped", [False, True])
@pytest.mark.parametrize("lumped", [False, True])
def test_frequencies(limits, caplog, is_clamped, lumped):
    spline = spline_of(hex_cylinder(2, 2, 4), "h2s")
    supports = [Support("end", faces_of(spline, "z_min"), (0, 2))] if is_clamped else []
    caplog.set_level(logging.INFO)
    direct, found = both(
        limits, lambda: free_modes(spline, STEEL, 12, lumped=lumped, supports=supports)
    )
    elastic = slice(direct.rigid, None)
    assert found.frequency[elastic] == pytest.approx(direct.frequency[elastic], rel=1e-9)
    assert found.mass == direct.mass and "iterations" in caplog.text


@pytest.mark.slow
@pytest.mark.parametrize("components", [(0, 1, 2), (0, 2)])
def test_displacement_and_reactions(limits, components):
    spline = spline_of(hex_cylinder(2, 2, 4), "h2s")
    foot = Support("foot", faces_of(spline, "z_min"))
    top = Support("top", faces_of(spline, "z_max"), components, 0.01)
    load = Load(faces_of(spline, "z_max"), traction=(2e6, 0.0, 1e6))

    direct, found = both(
        limits, lambda: deform(spline, STEEL, [foot, top], [load], (0.0, 0.0, -9.81))
    )
    largest = abs(direct.displacement).max()
    # the continuous functions are found by an iteration, to a thousandth of what they add
    assert found.displacement == pytest.approx(direct.displacement, abs=1e-4 * largest)
    assert found.reactions == pytest.approx(
        direct.reactions, abs=1e-9 * abs(direct.reactions).max()
    )
    assert found.strain_energy == pytest.approx(direct.strain_energy, rel=1e-6)
    assert found.peak.value == pytest.approx(direct.peak.value, rel=1e-3)


@pytest.mark.slow
def test_modes_of_a_sector(limits, caplog):
    quarter = Cyclic(4)
    spline = spline_of(hex_box((4, 4, 3), (1, 1, 0.5)), "h2s", cyclic={"sectors": 4})
    caplog.set_level(logging.INFO)
    direct, found = both(limits, lambda: free_modes(spline, STEEL, 12, cyclic=quarter))
    assert found.rigid == direct.rigid == 2
    assert found.frequency[2:] == pytest.approx(direct.frequency[2:], rel=1e-9)
    steps = [record.args[2] for record in caplog.records if "iterations" in record.msg]
    assert len(steps) == 2 and max(steps) < 60, steps


@pytest.mark.slow
def test_conduction(limits):
    spline = spline_of(hex_cylinder(2, 2, 4), "h2s")
    foot = Support("foot", faces_of(spline, "z_min"), (0,), 300.0)
    top = Support("top", faces_of(spline, "z_max"), (0,), 400.0)
    direct, found = both(limits, lambda: conduct(spline, 50.0, [foot, top], source=1e8))
    assert found.values == pytest.approx(direct.values, rel=1e-9)
    assert found.flows == pytest.approx(direct.flows, rel=1e-9)


@pytest.mark.slow
def test_steps_do_not_grow_with_the_number_of_hexes(limits, caplog):
    limits(LIMIT=0)
    caplog.set_level(logging.INFO, preconditioner.__name__)
    steps = []
    for n in (4, 8, 12):
        spline = cube(n, "h2s")
        foot = Support("foot", faces_of(spline, "z_min"), (0,), 300.0)
        conduct(spline, 50.0, [foot], source=1e8)
        steps.append(caplog.records[-1].args[1])
    assert max(steps) < 50 and steps[-1] <= steps[1] + 4, steps
