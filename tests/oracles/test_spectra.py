"""Eigenvalues of elastic solids beside those of scikit-fem and nutils."""

import numpy as np
import pytest

from polycube.analysis.boundary_sets import faces_of
from polycube.analysis.constraints import Support
from polycube.analysis.modal import free_modes
from polycube.analysis.problem import Material
from tests.fixtures.hexmeshes import hex_cylinder
from tests.fixtures.splines import box, cube, spline_of
from tests.oracles.codes import by_nutils, by_scikit_fem, quadratic

pytestmark = [pytest.mark.oracles, pytest.mark.filterwarnings("ignore")]

SIDES = (2.0, 0.6, 0.4)
SOLID = Material(1.0, 0.3, 1.0)


def ours(spline, held=()):
    supports = [Support("x_min", faces_of(spline, "x_min"))] if held else []
    count = 6 if held else 12
    return free_modes(spline, SOLID, count, "m", supports=supports).eigenvalues[-6:]


@pytest.mark.parametrize("held", [(), (("xyz", 0, 0.0),)], ids=["free", "held"])
def test_scikit_fem_agrees_on_a_box(held):
    fem = pytest.importorskip("skfem")
    lines = [np.linspace(0, side, n + 1) for side, n in zip(SIDES, (12, 4, 3), strict=True)]
    theirs = by_scikit_fem(fem.MeshHex.init_tensor(*lines), 6 if held else 12, held)[-6:]
    found = ours(box((10, 3, 2), SIDES), held)
    assert found == pytest.approx(theirs, rel=2e-3)
    assert (found < theirs * (1 + 1e-9)).all()  # both from above, ours nearer


def test_scikit_fem_agrees_on_a_curved_solid():
    """Its elements go through the points of the spline: 40, then 320 beside 40 of ours."""
    spline = spline_of(hex_cylinder(2, 2, 2))
    found = ours(spline)
    coarse, fine = (by_scikit_fem(quadratic(spline, parts), 12)[-6:] for parts in (1, 2))
    assert found == pytest.approx(fine, rel=1e-3)
    assert abs(fine / found - 1).max() < 0.05 * abs(coarse / found - 1).max()


def test_nearer_to_the_exact_cube_than_both_with_fewer_functions():
    """Sliding faces: the lowest shear wave, 2 pi^2 mu."""
    fem = pytest.importorskip("skfem")
    exact = 2 * np.pi**2 / 2.6
    spline = cube(4)
    sides = [f"{axis}_{end}" for axis in "xyz" for end in ("min", "max")]
    supports = [Support(side, faces_of(spline, side), ("xyz".index(side[0]),)) for side in sides]
    found = free_modes(spline, SOLID, 3, "m", supports=supports).eigenvalues[0] / exact - 1
    held = [(axis, i, end) for i, axis in enumerate("xyz") for end in (0.0, 1.0)]
    line = np.linspace(0, 1, 5)
    theirs = by_scikit_fem(fem.MeshHex.init_tensor(line, line, line), 3, held)[0] / exact - 1
    others = by_nutils([np.linspace(0, 1, 4)] * 3, 3, "std", 2, sliding=True)[0] / exact - 1
    assert 0 < found < 3e-5
    assert theirs > 10 * found and others > 10 * found


def test_nutils_has_the_same_eigenvalues_in_the_same_space():
    counts = (4, 2, 2)
    lines = [np.linspace(0, side, n + 1) for side, n in zip(SIDES, counts, strict=True)]
    theirs = by_nutils(lines, 12, "spline", 3)[-6:]
    assert ours(box(counts, SIDES)) == pytest.approx(theirs, rel=1e-9)
