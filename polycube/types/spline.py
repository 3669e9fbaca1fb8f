"""Volumetric splines as Bezier elements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from polycube.types.checks import freeze

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


@dataclass(frozen=True, eq=False)
class Spline:
    """Tricubic volumetric spline as Bezier elements.

    The Bezier points of element e are `(extraction @ control)[nodes[e]]`, in the order
    i + 4 j + 16 k, i fastest: neighbours of one level share nodes, so the solid is watertight.
    `sides` are the faces on the boundary, 0 to 5 for -xi +xi -eta +eta -zeta +zeta, and `patch`
    the polycube face that each came from.
    """

    control: np.ndarray  # (C, 3), one spline function each
    extraction: csr_matrix  # (B, C), rows sum to 1
    nodes: np.ndarray  # (E, 64) into the B Bezier nodes
    element_hex: np.ndarray  # (E,) hex each element came from
    level: np.ndarray  # (E,) of refinement: the hex halved so often
    sides: np.ndarray  # (Q, 2) element and face of it
    patch: np.ndarray  # (Q,)
    extraordinary_edges: int = 0
    sets: Mapping[str, np.ndarray] = field(default_factory=dict)  # numbers of sides (N,) by name

    def __post_init__(self) -> None:
        freeze(
            self,
            control=("C 3", np.float64),
            nodes=("E 64", np.int64),
            element_hex=("E", np.int64),
            level=("E", np.int64),
            sides=("Q 2", np.int64),
            patch=("Q", np.int64),
        )

    def element_functions(self, elements: slice = slice(None)) -> ElementFunctions:
        """Extraction operators of elements, functions that vanish there left out."""
        from scipy.sparse import csr_matrix  # commands that compute nothing start without it

        from polycube.types.local_functions import gathered

        nodes, matrix = self.nodes[elements], self.extraction
        offsets, functions, *rows = gathered(
            matrix.indptr, matrix.indices, matrix.data, nodes, matrix.shape[1]
        )
        starts, places, values = rows
        coefficients = csr_matrix((values, places, starts), (len(functions), 64))
        return ElementFunctions(offsets, functions, coefficients)


@dataclass(frozen=True, eq=False)
class ElementFunctions:
    """The spline functions of each element and their Bezier coefficients there.

    Rows offsets[e] to offsets[e + 1] belong to element e, its functions ascending.
    """

    offsets: np.ndarray  # (E + 1,)
    functions: np.ndarray  # (R,) into the C control points
    coefficients: csr_matrix  # (R, 64)

    def padded(self, elements: np.ndarray, absent: int) -> tuple[np.ndarray, np.ndarray]:
        """Functions (n, f) and dense extraction (n, f, 64) of some elements (n,).

        absent : stands for a function where an element has fewer than others; its row is 0
        """
        count = np.diff(self.offsets)[elements]
        element, place = np.nonzero(np.arange(count.max()) < count[:, None])
        rows = self.offsets[elements][element] + place
        functions = np.full((len(elements), count.max()), absent)
        functions[element, place] = self.functions[rows]
        extraction = np.zeros((*functions.shape, 64))
        extraction[element, place] = self.coefficients[rows].toarray()
        return functions, extraction
