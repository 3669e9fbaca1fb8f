"""Whether trilinear hexes are positive everywhere, not only at their corners.

det J of a trilinear map is a polynomial of degree 2 in each of xi, eta, zeta.  Its 27 Bernstein
coefficients on a box bound it from below and the corner ones are values; a box whose bound is not
positive is halved in each direction (de Casteljau) until a value or the bound decides.
(Johnen, Weill, Remacle: Robust and efficient validation of the linear hexahedral element, 2017.)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from math import comb

import numpy as np

from polycube.hexmesh.connectivity import EDGES, PLACES

MAX_LEVEL = 12  # halvings of a box
MAX_NUMBERS = 2_700_000  # in the boxes open at once; 22 MB
CHUNK = 50_000  # hexes at a time
ROUNDING = 1e-12  # of the largest frame of a hex: a bound no larger is not taken for positive

_NODES = np.array([0.0, 0.5, 1.0])
_GRID = np.array(list(product(_NODES, repeat=3)))  # (27, 3), zeta fastest
_TO_BERNSTEIN = np.array([[1, 0, 0], [-0.5, 2, -0.5], [0, 0, 1]])  # from values at the nodes


@dataclass(frozen=True, eq=False)
class Certificate:
    """det J of each hex over its mean there, which is 1 in a parallelepiped."""

    least: np.ndarray  # (H,) smallest value met
    bound: np.ndarray  # (H,) nowhere smaller, to rounding

    @property
    def positive(self) -> np.ndarray:
        """(H,) whether det J is certainly positive everywhere."""
        return self.bound > 0

    @property
    def refuted(self) -> np.ndarray:
        """(H,) whether det J is zero or negative somewhere; what is neither is undecided."""
        return self.least <= 0


def certify(vertices: np.ndarray, hexes: np.ndarray) -> Certificate:
    """Bounds of det J of hexes (H, 8); only as sharp as the sign needs."""
    parts = [_chunk(vertices, part) for part in np.array_split(hexes, len(hexes) // CHUNK + 1)]
    return Certificate(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def coefficients(corners: np.ndarray) -> np.ndarray:
    """(H, 27) Bernstein coefficients of det J on the unit cube, zeta fastest; corners (H, 8, 3)."""
    values = np.linalg.det(np.einsum("qac,hcd->hqad", _gradients(_GRID), corners, optimize=True))
    return _along_axes(values, (_TO_BERNSTEIN,) * 3)


def _chunk(vertices: np.ndarray, hexes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    corners = vertices[hexes] - vertices[hexes[:, :1]]  # a far placement would cost digits
    boxes = coefficients(corners)
    mean = np.abs(boxes.mean(axis=1))
    length = np.linalg.norm(corners[:, EDGES[:, 1]] - corners[:, EDGES[:, 0]], axis=2).max(axis=1)
    tiny = ROUNDING * np.maximum(length**3, np.finfo(float).tiny)
    least, bound = signed_bounds(boxes - tiny[:, None], 2)
    return least / np.maximum(mean, tiny), bound / np.maximum(mean, tiny)


def signed_bounds(boxes: np.ndarray, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Least value met and bound (H,) of polynomials of a degree in each of three variables.

    boxes : (H, (degree + 1)^3) Bernstein coefficients on the unit cube.  A box is halved only
        where the sign is open.
    """
    halves, ends = _halves(degree)
    owner = np.arange(len(boxes))
    least = boxes[:, ends].min(axis=1)
    settled = np.full(len(boxes), np.inf)
    for level in range(MAX_LEVEL + 1):
        np.minimum.at(least, owner, boxes[:, ends].min(axis=1))
        bound = boxes.min(axis=1)
        is_open = (bound <= 0) & (least[owner] > 0)
        if level == MAX_LEVEL or 8 * is_open.sum() > MAX_NUMBERS // boxes.shape[1]:
            is_open[:] = False
        np.minimum.at(settled, owner[~is_open], bound[~is_open])
        if not is_open.any():
            return least, settled
        owner = np.tile(owner[is_open], 8)
        boxes = np.concatenate([_along_axes(boxes[is_open], each) for each in halves])
    raise AssertionError("the last level returns")


@lru_cache
def _halves(degree: int) -> tuple[list[tuple[np.ndarray, ...]], np.ndarray]:
    """Matrices along the axes that halve a box, for each of eight; which coefficients are values.

    By de Casteljau's rule.
    """
    n = degree + 1
    low = np.array([[comb(i, j) / 2**i for j in range(n)] for i in range(n)])
    ends = np.array(list(product((0, degree), repeat=3))) @ [n * n, n, 1]
    return list(product((low, low[::-1, ::-1]), repeat=3)), ends


def _along_axes(values: np.ndarray, matrices: tuple[np.ndarray, ...]) -> np.ndarray:
    """Apply a (m, m) matrix per axis to tensors (n, m^3)."""
    x, y, z = matrices
    cube = values.reshape(-1, len(x), len(x), len(x))
    return np.einsum("nijk,ai,bj,ck->nabc", cube, x, y, z, optimize=True).reshape(values.shape)


def _gradients(at: np.ndarray) -> np.ndarray:
    """(Q, 3, 8) gradients of the trilinear shape functions at parameters (Q, 3)."""
    factors = np.where(PLACES, at[:, None], 1 - at[:, None])  # (Q, 8, 3)
    slopes = np.where(PLACES, 1.0, -1.0)
    parts = []
    for axis in range(3):
        mixed = factors.copy()
        mixed[:, :, axis] = slopes[:, axis]
        parts.append(mixed.prod(axis=2))
    return np.stack(parts, axis=1)
