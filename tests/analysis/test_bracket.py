"""An L-bracket clamped at one end: deflection and frequency of a beam.

With x_min clamped, the lower leg is a cantilever. Its effective root is between the inner face of
the upright and the middle of it, so its stiffness is between those of beams of these two lengths,
which differ by 17 % in the deflection and 11 % in the frequency. Poisson's ratio is 0, as in beam
theory. If x_min consisted of both legs, like the patch of a straight bar that is bent around the
corner, the bracket would be a thousand times too stiff.
"""

from dataclasses import replace

import numpy as np
import pytest

from polycube.analysis.recovery import samples
from polycube.hexmesh.named_sets import boundary_sets, sets_of_spline
from polycube.io.hex_meshes import boundary
from polycube.registry import build
from tests.fixtures.industrial import LEG, THICK, WIDE, bracket

MATERIAL = {"young": 210e9, "poisson": 0.0, "density": 7850.0}
LENGTHS = (LEG - THICK, LEG - THICK / 2)  # of the lower leg: free, and to the middle of the upright
FORCE = 100.0  # N
YOUNG = 210e3  # N/mm^2
AREA, INERTIA = WIDE * THICK, WIDE * THICK**3 / 12


@pytest.fixture(scope="module")
def spline():
    mesh = bracket()
    mesh = replace(mesh, sets=boundary_sets(mesh))
    found = build("spline", {"plugin": "h2s"})(boundary(mesh), mesh)
    return replace(found, sets=sets_of_spline(found, mesh))


def deflection(spline, fixed):
    """Largest deflection in mm under a force at the free end of the lower leg."""
    load = {"at": "x_max", "force": [0, 0, -FORCE]}
    options = {"fixed": fixed, "loads": [load], "material": MATERIAL}
    found = build("analysis", {"plugin": "static", **options})(spline)
    return -samples(spline, found.displacement)[..., 2].min()


def bending(length):
    return FORCE * length**3 / (3 * YOUNG * INERTIA)


def shear(length):
    return 1.2 * FORCE * length / (YOUNG / 2 * AREA)


def test_clamped_at_x_min_the_lower_leg_is_a_cantilever(spline):
    low, high = (bending(length) + shear(length) for length in LENGTHS)
    assert low < deflection(spline, ["x_min"]) < high


def test_clamped_at_the_tip_of_the_upright_it_is_a_frame(spline):
    """The upright bends by the moment of the force: F a^3 / 3 E I + F a^2 b / E I, with b = a."""
    low, high = (4 * bending(length) + shear(length) for length in LENGTHS)
    assert low < deflection(spline, ["z_max"]) < high


def test_clamped_at_both_legs_it_hardly_moves(spline):
    """In a former version, x_min was the patch of both legs."""
    both = spline.sets["patch_0"]
    assert sorted(both) == sorted([*spline.sets["x_min"], *spline.sets["z_min"]])
    assert deflection(spline, ["patch_0"]) < bending(LENGTHS[0]) / 1000


@pytest.mark.slow
def test_the_first_frequency_is_that_of_a_cantilever(spline):
    """(1.8751 / l)^2 sqrt(E I / rho A) / 2 pi, in Hz, with lengths in m."""
    options = {"fixed": ["x_min"], "modes": 1, "material": MATERIAL}
    found = build("analysis", {"plugin": "modal", **options})(spline).frequency[0]
    wave = np.sqrt(210e9 * INERTIA * 1e-12 / (7850 * AREA * 1e-6)) / (2 * np.pi)
    high, low = (1.8751**2 / (length * 1e-3) ** 2 * wave for length in LENGTHS)
    assert low < found < high
