"""Matrices of a spline with both triangles."""

from scipy.sparse import bsr_matrix, csr_matrix

from polycube.analysis.assembly import Elements, assemble_lower, assemble_scalar_lower
from polycube.analysis.problem import Material
from polycube.types import Spline


def assemble(
    spline: Spline, young: float, poisson: float, density: float, n_gauss: int = 4
) -> tuple[bsr_matrix, csr_matrix]:
    """Stiffness and mass as in `assemble_lower`, of a material, with both triangles."""
    solid = Material(young, poisson, density)
    stiffness, mass = assemble_lower(Elements.of(spline), solid, n_gauss)
    return stiffness.full(), mass.full().tocsr()


def assemble_scalar(spline: Spline, n_gauss: int = 4) -> tuple[csr_matrix, csr_matrix]:
    """Stiffness and mass as in `assemble_scalar_lower`, with both triangles."""
    laplace, mass = assemble_scalar_lower(Elements.of(spline), n_gauss)
    return laplace.full().tocsr(), mass.full().tocsr()
