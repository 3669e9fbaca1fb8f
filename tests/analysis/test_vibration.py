"""Vibration of solids whose modes are known: cube, bar, beams; rigid motions; lumped mass."""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

from polycube.analysis.boundary_sets import faces_of
from polycube.analysis.constraints import Support
from polycube.analysis.modal import free_modes
from polycube.analysis.problem import MATERIALS, Material
from polycube.hexmesh.named_sets import ENDS
from tests.fixtures.hexmeshes import hex_ball, hex_cylinder
from tests.fixtures.splines import box, cube, spline_of

STRAIGHT = Material(1.0, 0.0, 1.0)


def clamped(spline, **components):
    return [
        Support(place, faces_of(spline, place), tuple("xyz".index(axis) for axis in axes))
        for place, axes in components.items()
    ]


@pytest.mark.slow
@pytest.mark.parametrize("space", ["h2s", "optimal"])
@pytest.mark.parametrize("mesh", [hex_ball(2), hex_cylinder(2, 2, 2)], ids=["ball", "cylinder"])
def test_rigid_motions_have_frequency_zero(mesh, space):
    modes = free_modes(spline_of(mesh, space), MATERIALS["steel"], 8)
    assert modes.rigid == 6
    assert abs(modes.eigenvalues[:6]).max() < 1e-10 * modes.eigenvalues[6]


@pytest.mark.parametrize(("space", "n", "off"), [("optimal", 4, 3e-5), ("h2s", 6, 2e-3)])
def test_waves_of_a_cube_with_sliding_faces(space, n, off):
    """S waves mu k^2 and P waves (lambda + 2 mu) k^2; no normal motion, no shear on the faces."""
    spline = cube(n, space)
    supports = clamped(spline, **{end: end[0] for end in ENDS})
    modes = free_modes(spline, Material(1.0, 0.3, 1.0), 9, "m", supports=supports)
    shear, pressure = 1 / 2.6, 2 / 2.6 + 0.3 / (1.3 * 0.4)
    exact = np.pi**2 * np.array([2 * shear] * 3 + [3 * shear] * 2 + [pressure] * 3)
    assert modes.rigid == 0
    assert modes.eigenvalues[:8] == pytest.approx(exact, rel=off)
    assert modes.eigenvalues[8] == pytest.approx(np.pi**2 * 5 * shear, rel=0.01)


def test_axial_waves_of_a_free_bar_without_contraction():
    """nu = 0: omega = n pi exactly, in three dimensions."""
    modes = free_modes(box((6, 1, 1), (1.0, 0.4, 0.3)), STRAIGHT, 24, "m")
    omega = np.sqrt(modes.eigenvalues[6:])
    for n, off in ((1, 1e-6), (2, 5e-5)):
        assert abs(omega / (n * np.pi) - 1).min() < off


def timoshenko(height, is_held, slender):
    """omega of a beam of length 1, E = density = 1, nu = 0: (b L)^2 = slender, but lower."""
    area, inertia, stiff = height**2, height**4 / 12, 5 / 6 * height**2 / 2

    def missed(omega):
        square = omega**2
        rates = [
            [0, 1, 0, 1 / stiff],  # deflection, turn, moment, shear force
            [0, 0, 1 / inertia, 0],
            [0, -inertia * square, 0, -1],
            [-area * square, 0, 0, 0],
        ]
        carried = expm(np.array(rates))[2:]
        return np.linalg.det(carried[:, 2:] if is_held else carried[:, :2])

    guess = slender * np.sqrt(inertia / area)
    return brentq(missed, 0.7 * guess, 1.01 * guess)


@pytest.mark.parametrize(
    ("is_held", "first", "slender"),
    [(False, 6, (22.37329, 61.67282)), (True, 0, (3.516015, 22.034492))],
    ids=["free", "cantilever"],
)
def test_beams_bend_as_timoshenko_beams(is_held, first, slender):
    height = 0.1
    spline = box((8, 1, 1), (1.0, height, height))
    supports = clamped(spline, x_min="xyz") if is_held else []
    modes = free_modes(spline, STRAIGHT, first + 4, "m", supports=supports)
    omega = np.sqrt(modes.eigenvalues[first:])
    for pair, (value, off) in enumerate(zip(slender, (5e-5, 5e-4), strict=True)):
        exact = timoshenko(height, is_held, value)
        assert exact < value * height / np.sqrt(12)
        assert omega[2 * pair : 2 * pair + 2] == pytest.approx([exact] * 2, rel=off)


def test_lumped_mass_lowers_eigenvalues_by_a_third_of_the_wave_number_times_h_squared():
    n = 48
    spline = box((n, 1, 1), (1.0, 0.01, 0.01), "h2s")
    sides = Support("all", np.arange(len(spline.sides)), (1, 2))
    supports = [sides, *clamped(spline, x_min="x", x_max="x")]
    modes = free_modes(spline, STRAIGHT, 3, "m", lumped=True, supports=supports)
    k = np.pi * np.arange(1, 4)
    lowered = 1 - modes.eigenvalues / k**2
    assert lowered / ((k / n) ** 2 / 3) == pytest.approx(np.ones(3), abs=0.03)
