"""Volumetric splines as Bezier elements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np

from polycube.types.checks import Arrays

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

CHUNK = 8192  # elements whose functions are found together, to save memory


@dataclass(frozen=True, eq=False)
class Spline(Arrays):
    """Tricubic volumetric spline in the form of Bezier elements.

    The Bezier points of element e are `(extraction @ control)[nodes[e]]`, in order
    i + 4 j + 16 k.
    Neighbouring elements of one level share nodes, so the solid is watertight.

    Parameters
    ----------
    control : (C, 3) control points in the user's units, one for each spline function
    extraction : (B, C) sparse matrix from control points to Bezier nodes; rows sum to 1
    nodes : (E, 64) Bezier nodes of each element
    element_hex : (E,) number of the hex of each element
    level : (E,) refinement level; an element of level l is 1/2^l of a hex in each direction
    sides : (Q, 2) element and face number of the boundary faces; 0 to 5 for -xi +xi -eta +eta
        -zeta +zeta
    patch : (Q,) polycube face of each boundary face
    extraordinary_edges : number of extraordinary edges of the hex mesh
    sets : named boundary sets, (N,) row numbers of `sides`
    inner_edges : (R, 2) pairs of rows of `sides` that meet at a re-entrant edge of the CAD model
    offset : (Q, 25) distance by which the part is outside each boundary face, at 5^2 Gauss points;
        no rows if it is not known
    tilt : (Q,) largest angle between the normals of the part and of each boundary face, in radians
    place : (B,) first Bezier node at the place of each: solids of an assembly have own nodes, with
        equal rows of the extraction; empty if no two nodes are at one place
    """

    control: Annotated[np.ndarray, "C 3"]
    extraction: csr_matrix
    nodes: Annotated[np.ndarray, "E 64 int"]
    element_hex: Annotated[np.ndarray, "E int"]
    level: Annotated[np.ndarray, "E int"]
    sides: Annotated[np.ndarray, "Q 2 int"]
    patch: Annotated[np.ndarray, "Q int"]
    extraordinary_edges: int = 0
    sets: Mapping[str, np.ndarray] = field(default_factory=dict)
    inner_edges: Annotated[np.ndarray, "R 2 int"] = field(default_factory=lambda: np.zeros((0, 2)))
    offset: Annotated[np.ndarray, "P 25"] = field(default_factory=lambda: np.zeros((0, 25)))
    tilt: Annotated[np.ndarray, "P"] = field(default_factory=lambda: np.zeros(0))
    place: Annotated[np.ndarray, "N int"] = field(default_factory=lambda: np.zeros(0))

    bounds: ClassVar = {
        "nodes": "extraction",
        "sides": ("nodes", 6),
        "sets": "sides",
        "inner_edges": "sides",
        "place": "extraction",
    }

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.extraction.shape[1:] != (len(self.control),):
            raise ValueError(f"Spline.extraction must have {len(self.control)} columns")

    @property
    def places(self) -> np.ndarray:
        """(B,) `place`, or the number of each node."""
        return self.place if len(self.place) else np.arange(self.extraction.shape[0])

    def element_functions(self, elements: slice = slice(None)) -> ElementFunctions:
        """Extraction operators of elements, without functions that vanish there."""
        from scipy.sparse import vstack  # commands that compute nothing start without it

        nodes = self.nodes[elements]
        each = [self._functions(few) for few in np.array_split(nodes, len(nodes) // CHUNK + 1)]
        starts = np.cumsum([0, *(len(few.functions) for few in each)])
        offsets = [few.offsets[:-1] + start for few, start in zip(each, starts, strict=False)]
        return ElementFunctions(
            np.concatenate([*offsets, starts[-1:]]),
            np.concatenate([few.functions for few in each]),
            vstack([few.coefficients for few in each], "csr"),
        )

    def _functions(self, nodes: np.ndarray) -> ElementFunctions:
        """Extraction operators of some elements, of nodes (e, 64)."""
        from scipy.sparse import csr_matrix

        rows = self.extraction[nodes.ravel()]
        place = np.repeat(np.arange(rows.shape[0]) % 64, np.diff(rows.indptr))
        entries = rows.data, 64 * rows.indices.astype(np.int64) + place, rows.indptr[::64]
        found = csr_matrix(entries, (rows.shape[0] // 64, 64 * rows.shape[1]))
        found.sort_indices()  # in each element by function, then by Bezier node
        function, place = np.divmod(found.indices.astype(np.int64), 64)
        is_first = np.diff(function, prepend=-1) != 0
        is_first[found.indptr[:-1]] = True
        first = np.flatnonzero(is_first)
        entries = found.data, place, np.append(first, len(place))
        coefficients = csr_matrix(entries, (len(first), 64))
        return ElementFunctions(np.searchsorted(first, found.indptr), function[first], coefficients)


@dataclass(frozen=True, eq=False)
class ElementFunctions:
    """Spline functions of each element, and their Bezier coefficients on it.

    Parameters
    ----------
    offsets : (E + 1,) rows offsets[e] to offsets[e + 1] belong to element e
    functions : (R,) number of the control point of each row, ascending for each element
    coefficients : (R, 64) sparse Bezier coefficients
    """

    offsets: np.ndarray
    functions: np.ndarray
    coefficients: csr_matrix

    def padded(self, elements: np.ndarray, absent: int) -> tuple[np.ndarray, np.ndarray]:
        """Functions (n, f) and dense extraction (n, f, 64) of some elements (n,).

        absent : number used if an element has fewer functions than others; its row is zero
        """
        count = np.diff(self.offsets)[elements]
        element, place = np.nonzero(np.arange(count.max()) < count[:, None])
        rows = self.offsets[elements][element] + place
        functions = np.full((len(elements), count.max()), absent)
        functions[element, place] = self.functions[rows]
        extraction = np.zeros((*functions.shape, 64))
        extraction[element, place] = self.coefficients[rows].toarray()
        return functions, extraction
