"""The spline of several solids, and analyses on it: exact solutions that bend at interfaces."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq

from polycube.analysis.boundary_sets import faces_of
from polycube.analysis.constraints import Support
from polycube.analysis.loads import Load
from polycube.analysis.modal import free_modes
from polycube.analysis.peaks import singular_places
from polycube.analysis.poisson import conduct
from polycube.analysis.problem import Flow, Material
from polycube.analysis.recovery import samples
from polycube.analysis.static import deform
from polycube.errors import InputError
from polycube.spline.bezier import bezier_points, min_detj
from polycube.spline.boundary import unshared_faces
from tests.fixtures.blocks import block, spline_of_all

LENGTHS = 2, 3
BAR = [block([0, 0, 0], (2, 2, 2)), block([2, 0, 0], (3, 2, 2), 1)]
SOLID = np.repeat([0, 1], [8, 12])  # of each hex of the bar
SQUARE = [block([2 * i, 2 * j, 0], (2, 2, 2), 2 * i + j) for i in (0, 1) for j in (0, 1)]


@pytest.fixture(scope="module")
def bar():
    return spline_of_all(BAR)


def of_bar(*materials):
    return Material.of_elements([Material(*each) for each in materials], SOLID)


def held(spline, **components):
    """Supports of components at ends of the whole, such as x_min="x"."""
    return [
        Support(name, faces_of(spline, name), tuple("xyz".index(axis) for axis in axes))
        for name, axes in components.items()
    ]


def bent(x, first, second):
    """Values with a slope of `first` up to the interface, and of `second` from there."""
    return np.where(x < 2, first * x, 2 * first + second * (x - 2))


def test_the_spline_has_the_geometry_of_both_and_one_function_at_a_vertex(bar):
    assert len(bar.control) == 6 * 3 * 3 and len(bar.sides) == 2 * (4 + 2 * 5 * 2)
    jacobian = min_detj(bar)
    assert jacobian.volume == pytest.approx(5 * 2 * 2) and jacobian.lower_bound > 0
    for k, own in enumerate(BAR):
        points = bezier_points(bar)[SOLID == k]
        corners = own.vertices[own.hexes]
        assert points.min(axis=1) == pytest.approx(corners.min(axis=1))
        assert points.max(axis=1) == pytest.approx(corners.max(axis=1))
    [copies] = np.nonzero(bar.place != np.arange(len(bar.place)))
    assert len(copies) == 7 * 7  # the Bezier nodes of the interface
    assert (bar.extraction @ bar.control)[copies][:, 0] == pytest.approx(2)
    assert abs(bar.extraction[copies] - bar.extraction[bar.place[copies]]).max() == 0
    inner = unshared_faces(bar.places[bar.nodes])
    assert sorted(map(tuple, inner)) == sorted(map(tuple, bar.sides))


def test_sets_are_those_of_the_solids_and_the_ends_of_all(bar):
    names = [f"{solid}_{axis}_{end}" for solid in "ab" for axis in "xyz" for end in ("min", "max")]
    ends = [name[2:] for name in names[:6]]
    assert set(bar.sets) == {*names, *ends} - {"a_x_max", "b_x_min"}
    assert len(bar.sets["y_max"]) == 10 and len(bar.sets["b_y_max"]) == 6


def test_functions_on_an_interface_depend_on_its_vertices_alone():
    spline = spline_of_all(SQUARE)
    points, (owner, copies) = spline.control, np.unique(spline.place, return_counts=True)
    for node in owner[copies > 1]:
        _, own = spline.extraction[node].nonzero()
        assert (points[own] == 2)[:, :2].any(axis=1).all()
    assert copies.max() == 4  # on the line where four blocks meet


LUG = [block([0, 0, 0], (4, 4, 1)), block([1, 1, 1], (2, 2, 2), 1)]


@pytest.mark.parametrize("parts", [SQUARE, LUG], ids=["four around a line", "small on large"])
def test_a_linear_displacement_is_exact_across_contacts(parts):
    spline = spline_of_all(parts)
    slope = np.array([[0.1, 0.2, 0.0], [-0.3, 0.4, 0.7], [0.5, 0.0, -0.2]]) * 1e-3
    every = Support("all", np.arange(len(spline.sides)), value=lambda x: x @ slope.T)
    found = deform(spline, Material(3.0, 0.3, 2.0), [every], length_unit="m")
    wanted = spline.extraction @ spline.control @ slope.T
    assert found.displacement == pytest.approx(wanted, abs=1e-12)
    assert np.ptp(found.stress, axis=0) == pytest.approx(np.zeros(6), abs=1e-11)


def test_the_corner_between_two_solids_is_a_sharp_inner_edge():
    spline = spline_of_all(LUG)
    foot = Support("z_min", faces_of(spline, "z_min"))
    kinds = [each.what for each in singular_places(spline, [foot], [], 0.1)]
    assert kinds == ["sharp inner edge", "border of z_min"]


def test_bars_in_series_under_tension_are_exact(bar):
    """nu / E is the same in both, and so are the lateral strains."""
    solid = of_bar((3.0, 0.3, 2.0), (1.5, 0.15, 1.0))
    at = held(bar, x_min="x", y_min="y", z_min="z")
    pull = Load(faces_of(bar, "x_max"), traction=(1e-3, 0.0, 0.0))
    found = deform(bar, solid, at, [pull], length_unit="m")
    x, y, z = (bar.extraction @ bar.control).T
    wanted = np.stack([bent(x, 1e-3 / 3, 1e-3 / 1.5), -1e-4 * y, -1e-4 * z], axis=1)
    assert found.displacement == pytest.approx(wanted, abs=1e-12)
    assert found.stress == pytest.approx(np.tile([1e-3, 0, 0, 0, 0, 0], (len(x), 1)), abs=1e-12)
    assert found.mass == pytest.approx(2 * 8 + 12) and found.stress_error < 1e-9
    assert found.strain_energy == pytest.approx(4 * 1e-6 * (2 / 3 + 3 / 1.5) / 2, rel=1e-9)


def test_the_stress_jumps_at_the_interface_and_is_not_averaged_there(bar):
    """Compression without lateral strain: only the stress along the bar is the same."""
    materials = (3.0, 0.3, 2.0), (1.0, 0.1, 1.0)
    solid = of_bar(*materials)
    moduli = [Material(*each).lame + 2 * Material(*each).shear for each in materials]
    at = held(bar, x_min="x", y_min="y", z_min="z", y_max="y", z_max="z")
    push = Load(faces_of(bar, "x_max"), pressure=1e-3)
    found = deform(bar, solid, at, [push], length_unit="m")
    x = (bar.extraction @ bar.control)[:, 0]
    wanted = bent(x, *(-1e-3 / modulus for modulus in moduli))
    assert found.displacement[:, 0] == pytest.approx(wanted, abs=1e-12)
    for k, (material, modulus) in enumerate(zip(materials, moduli, strict=True)):
        stress = samples(bar, found.stress)[SOLID == k]
        assert stress[..., 0] == pytest.approx(-1e-3, abs=1e-12)
        assert stress[..., 1] == pytest.approx(
            -1e-3 * Material(*material).lame / modulus, abs=1e-12
        )


def test_the_stress_at_the_border_of_two_materials_is_singular(bar):
    pull = Load(faces_of(bar, "x_max"), traction=(1e-3, 0.0, 0.0))
    at = held(bar, x_min="x", y_min="y", z_min="z")
    found = deform(bar, of_bar((3.0, 0.3, 2.0), (1.0, 0.3, 1.0)), at, [pull], length_unit="m")
    assert found.singular.what == "border between two materials"
    assert abs(found.peak.at[0] - 2) > 0.5
    alike = deform(bar, of_bar(*[(3.0, 0.3, 2.0)] * 2), at, [pull], length_unit="m")
    assert alike.singular is None


def test_heating_of_free_bars_with_one_expansion_has_no_stress(bar):
    solid = of_bar((3.0, 0.3, 2.0, 1e-5), (1.0, 0.1, 1.0, 1e-5))
    at = held(bar, x_min="x", y_min="y", z_min="z")
    found = deform(bar, solid, at, length_unit="m", temperature=100.0)
    assert found.displacement == pytest.approx(1e-3 * bar.extraction @ bar.control, abs=1e-12)
    assert abs(found.stress).max() < 1e-12


def test_frequencies_of_a_rod_of_two_materials(bar):
    """The rod equation of two segments, one end fixed: nu = 0, and no lateral motion."""
    (e, _, r), (f, _, s) = materials = (3.0, 0.0, 2.0), (1.0, 0.0, 5.0)
    at = held(bar, x_min="xyz", y_min="yz", y_max="yz", z_min="yz", z_max="yz", x_max="yz")
    found = free_modes(bar, of_bar(*materials), 6, "m", supports=at, enrich=True)

    def off(omega):
        a, b = omega * np.sqrt(r / e), omega * np.sqrt(s / f)
        return e * a * np.cos(2 * a) * np.cos(3 * b) - f * b * np.sin(2 * a) * np.sin(3 * b)

    ends = np.linspace(1e-3, 1, 1000)
    roots = [brentq(off, a, b) for a, b in pairwise(ends) if off(a) * off(b) < 0]
    for root in roots[:2]:
        assert abs(np.sqrt(found.eigenvalues) / root - 1).min() < 1e-4
    assert found.mass == pytest.approx(2 * 8 + 5 * 12)


def test_conduction_through_two_materials_in_series_is_exact(bar):
    conductivity = np.array([50.0, 400.0])[SOLID]
    cold = Support("x_min", faces_of(bar, "x_min"), (0,))
    found = conduct(bar, conductivity, [cold], [Flow(faces_of(bar, "x_max"), 1e3)], length_unit="m")
    assert found.values == pytest.approx(bent(bar.control[:, 0], 1e3 / 50, 1e3 / 400), abs=1e-9)
    assert found.flux == pytest.approx(np.tile([-1e3, 0, 0], (len(found.flux), 1)), abs=1e-9)
    assert found.flows == pytest.approx([-4e3]) and found.flux_error < 1e-9


def test_spaces_with_other_functions_are_refused():
    for space in ({"space": "optimal"}, {"refine": {"levels": 1}}):
        with pytest.raises(InputError, match="use spline=h2s without refinement"):
            spline_of_all(BAR, **space)


def test_auto_takes_functions_that_can_be_joined(bar):
    found = spline_of_all(BAR, "auto", solves="modal")
    assert found.control == pytest.approx(bar.control)


def test_nearly_equal_borders_are_joined_at_shared_vertices():
    """The mesh of one block is a little longer; the vertices of the interface are in the middle."""
    first, second = BAR
    longer = replace(first, vertices=first.vertices * [1 + 1e-3, 1, 1])
    assert len(spline_of_all([longer, second]).control) == 5 * 9 + 2 * 9
