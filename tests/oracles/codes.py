"""Spectra of elastic solids, E = 1, nu = 0.3, density 1, by other codes."""

import warnings
from collections.abc import Sequence

import numpy as np
import pytest
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import eigsh

from polycube.types import Spline
from tests.oracles.elements import sampled

SHEAR, LAME = 1 / 2.6, 0.3 / (1.3 * 0.4)


def by_scikit_fem(mesh, n_modes: int, held: Sequence[tuple[str, int, float]] = ()) -> np.ndarray:
    """Lowest eigenvalues with triquadratic hexes.

    held : components, and the axis and coordinate of the plane where they are, as ("xyz", 0, 0.0)
    """
    fem = pytest.importorskip("skfem")
    from skfem.helpers import ddot, dot, sym_grad, trace

    basis = fem.Basis(mesh, fem.ElementVector(fem.ElementHex2()), intorder=5)

    @fem.BilinearForm
    def stiffness(u, v, w):
        e, d = sym_grad(u), sym_grad(v)
        return 2 * SHEAR * ddot(e, d) + LAME * trace(e) * trace(d)

    @fem.BilinearForm
    def mass(u, v, w):
        return dot(u, v)

    k, m = stiffness.assemble(basis), mass.assemble(basis)
    bound = [_bound(basis, *side) for side in held]
    return _lowest(k, m, n_modes, np.concatenate(bound) if bound else np.zeros(0, int))


def _bound(basis, names: str, axis: int, value: float) -> np.ndarray:
    dofs = basis.get_dofs(lambda x: np.isclose(x[axis], value))
    return dofs.all([f"u^{'xyz'.index(name) + 1}" for name in names])


def by_nutils(
    lines: Sequence[np.ndarray], n_modes: int, kind: str, degree: int, sliding: bool = False
) -> np.ndarray:
    """Lowest eigenvalues of a box, free or on sliding faces.

    kind : "spline", of full smoothness, or "std", Lagrange elements
    """
    mesh = pytest.importorskip("nutils.mesh")
    from nutils import function

    domain, x = mesh.rectilinear(lines)
    u = domain.basis(kind, degree=degree).vector(3)
    strain, dilation, volume = function.symgrad(u, x), function.div(u, x), function.J(x)
    energy = 2 * SHEAR * np.sum(strain[:, None] * strain[None], [-2, -1])
    energy = (energy + LAME * dilation[:, None] * dilation[None]) * volume
    inertia = np.sum(u[:, None] * u[None], -1) * volume
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = domain.integrate([energy, inertia], degree=2 * degree)
    k, m = (csr_matrix(matrix.export("csr")) for matrix in found)
    bound = np.zeros(k.shape[0], bool)
    for i, side in enumerate(("left,right", "bottom,top", "front,back") if sliding else ()):
        at = domain.boundary[side].project(0.0, onto=u[:, i], geometry=x, degree=2 * degree)
        bound |= ~np.isnan(at)
    return _lowest(k, m, n_modes, np.flatnonzero(bound))


def quadratic(spline: Spline, parts: int):
    """scikit-fem's mesh of triquadratic hexes through a spline, each element in parts^3."""
    fem = pytest.importorskip("skfem")
    size = 2 * parts + 1
    points, _ = sampled(spline, np.linspace(0, 1, size))
    i, j, k = np.meshgrid(*[2 * np.arange(parts)] * 3, indexing="ij")
    first = (i + size * (j + size * k)).ravel()
    steps = np.array([1, size, size**2])
    corners = first[:, None] + np.rint(2 * fem.ElementHex1.doflocs).astype(int) @ steps
    nodes = first[:, None] + np.rint(2 * fem.ElementHex2.doflocs).astype(int) @ steps
    rounded = np.round(points[:, corners].reshape(-1, 3), 9)
    _, at, number = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
    vertices = points[:, corners].reshape(-1, 3)[at]
    straight = fem.MeshHex(vertices.T, number.reshape(-1, 8).T)
    curved = fem.MeshHex2.from_mesh(straight)
    places = np.array(curved.doflocs)
    places[:, curved.dofs.element_dofs] = points[:, nodes].reshape(-1, 27, 3).transpose(2, 1, 0)
    return fem.MeshHex2(places, curved.t)


def _lowest(k, m, n_modes: int, held: np.ndarray) -> np.ndarray:
    free = np.setdiff1d(np.arange(k.shape[0]), held)
    k, m = k[free][:, free], m[free][:, free]
    return np.sort(eigsh(k, n_modes, m, sigma=-0.01)[0])
