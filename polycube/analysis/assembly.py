"""Stiffness and consistent mass of linear elasticity and of -div k grad u on a volumetric spline.

For each element, the gradients g of its functions at Gauss points give S[ai, bj] = int g_ai g_bj,
and K[ai, bj] = lambda S[ai, bj] + mu S[aj, bi] + mu delta_ij sum_k S[ak, bk]; the trace of S over i
= j is the matrix of the Laplacian. The moduli are those of the element. Elements of one colour are
assembled together; their blocks are added to the lower triangle of one sparse pattern.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from polycube.analysis.problem import Material
from polycube.errors import MeshingError
from polycube.numerics.element_matrices import add_elements, colours, zero_matrices
from polycube.numerics.products import Symmetric
from polycube.numerics.threads import parts, side_by_side
from polycube.spline.bernstein import gauss, tensor, volume_basis
from polycube.types import ElementFunctions, Spline

Value = float | np.ndarray  # of all elements, or (E,) of each


@dataclass(frozen=True, eq=False)
class Elements:
    """Bezier elements and the functions of each."""

    functions: ElementFunctions
    points: np.ndarray  # (B, 3) Bezier points
    nodes: np.ndarray  # (E, 64) Bezier points of each element
    size: int  # total number of functions

    @classmethod
    def of(cls, spline: Spline) -> Elements:
        """The elements of a spline."""
        points = spline.extraction @ spline.control
        return cls(spline.element_functions(), points, spline.nodes, len(spline.control))


def assemble_lower(
    elements: Elements, solid: Material, n_gauss: int = 4
) -> tuple[Symmetric, Symmetric]:
    """Stiffness (3 C, 3 C) and mass (C, C) of a material, or of those of the elements.

    Displacement i of control point a is at 3 a + i. The mass is the same for the three directions.
    n_gauss : Gauss points per direction. Raises MeshingError if det J <= 0 at a Gauss point.
    """
    return _assemble(elements, n_gauss, 3, solid.lame, solid.shear, solid.density)


def assemble_scalar_lower(
    elements: Elements, n_gauss: int = 4, conductivity: Value = 1.0
) -> tuple[Symmetric, Symmetric]:
    """Stiffness of -div k grad u, and mass, both (C, C). Raises MeshingError as `assemble_lower`.

    conductivity : k, a number or (E,)
    """
    return _assemble(elements, n_gauss, 1, conductivity, 0.0, 1.0)


def _assemble(
    elements: Elements, n_gauss: int, order: int, *moduli: Value
) -> tuple[Symmetric, Symmetric]:
    """Stiffness with blocks of an order, and mass; `moduli` as for `add_elements`."""
    t, w = gauss(n_gauss)
    values, gradients = volume_basis(t)
    weights = tensor(w[None], w[None], w[None])[0]
    tables = weights, np.ascontiguousarray(values.T), np.concatenate(gradients).T.copy()
    functions = elements.functions
    stiffness, mass = zero_matrices(functions, elements.size, order, 1)
    matrix, each = functions.coefficients, np.empty((len(elements.nodes), 3))
    each[:] = np.stack(np.broadcast_arrays(*moduli), axis=-1)
    given = (
        *(functions.offsets, functions.functions, matrix.indptr, matrix.indices, matrix.data),
        *(elements.points, elements.nodes, *tables, each),
        *(stiffness.indptr, stiffness.indices, stiffness.blocks, mass.blocks),
    )
    for runs in colours(functions, elements.size):
        found = side_by_side(
            [partial(add_elements, runs[cut], *given) for cut in parts(len(runs), 1)]
        )
        det, element = min(found)
        if det <= 0:
            what = f"analysis needs det J > 0; got {det:.3g} at a Gauss point of element {element}"
            raise MeshingError(what)
    return stiffness, mass
