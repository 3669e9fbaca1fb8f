"""Agreement with other codes on the same solid; each runs where its package is installed."""

import numpy as np
import pytest
from scipy.sparse.linalg import eigsh

from polycube.spline.constraints import Support
from polycube.spline.material import Material
from polycube.spline.modal import free_modes
from polycube.spline.patches import faces_of
from tests.spline.spaces import box

SIDES = (2.0, 0.6, 0.4)
SOLID = Material(1.0, 0.3, 1.0)


def ours(counts, is_held):
    spline = box(counts, SIDES)
    supports = [Support("x_min", faces_of(spline, "x_min"))] if is_held else []
    count = 6 if is_held else 12
    return free_modes(spline, SOLID, count, "m", supports=supports).eigenvalues[-6:]


def by_scikit_fem(counts, is_held):
    """Triquadratic hexes."""
    fem = pytest.importorskip("skfem")
    from skfem.helpers import ddot, dot, sym_grad, trace

    mesh = fem.MeshHex.init_tensor(
        *(np.linspace(0, side, n + 1) for side, n in zip(SIDES, counts, strict=True))
    )
    basis = fem.Basis(mesh, fem.ElementVector(fem.ElementHex2()), intorder=5)
    shear, lame = 1 / 2.6, 0.3 / (1.3 * 0.4)

    @fem.BilinearForm
    def stiffness(u, v, w):
        e, d = sym_grad(u), sym_grad(v)
        return 2 * shear * ddot(e, d) + lame * trace(e) * trace(d)

    @fem.BilinearForm
    def mass(u, v, w):
        return dot(u, v)

    k, m = stiffness.assemble(basis), mass.assemble(basis)
    if is_held:
        held = basis.get_dofs(lambda x: np.isclose(x[0], 0)).flatten()
        free = np.setdiff1d(np.arange(k.shape[0]), held)
        k, m = k[free][:, free], m[free][:, free]
    return np.sort(eigsh(k, 6 if is_held else 12, m, sigma=-0.01)[0])[-6:]


@pytest.mark.parametrize("is_held", [False, True], ids=["free", "held"])
def test_scikit_fem_agrees(is_held):
    theirs = by_scikit_fem((12, 4, 3), is_held)
    found = ours((10, 3, 2), is_held)
    assert found == pytest.approx(theirs, rel=2e-3)
    assert (found < theirs * (1 + 1e-9)).all()  # both from above, ours nearer
