"""Certificate that trilinear hexes have a positive Jacobian everywhere, not only at corners.

det J of a trilinear map is a polynomial of degree 2 in each of xi, eta, zeta. Its 27 Bernstein
coefficients on a box are bounds from below, and those at the corners are values. A box with a
non-positive bound is halved in each direction (de Casteljau) until a value or the bound decides.
(Johnen, Weill, Remacle: Robust and efficient validation of the linear hexahedral element, 2017.)
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from math import comb

import numpy as np

from polycube.hexmesh.connectivity import EDGES, PLACES

MAX_LEVEL = 12  # largest number of times that a box is halved
MAX_NUMBERS = 2_700_000  # numbers in all undecided boxes at once; 22 MB
CHUNK = 50_000  # hexes in one batch
# relative to the largest frame of a hex: a smaller bound does not count as positive
ROUNDING = 1e-12

_NODES = np.array([0.0, 0.5, 1.0])
_GRID = np.array(list(product(_NODES, repeat=3)))  # (27, 3), zeta fastest
_TO_BERNSTEIN = np.array([[1, 0, 0], [-0.5, 2, -0.5], [0, 0, 1]])  # from values at the nodes


@dataclass(frozen=True, eq=False)
class Certificate:
    """det J of each hex relative to its mean value; 1 for a parallelepiped."""

    least: np.ndarray  # (H,) smallest value found
    bound: np.ndarray  # (H,) lower bound, up to rounding errors

    @property
    def positive(self) -> np.ndarray:
        """(H,) whether det J is certainly positive everywhere."""
        return self.bound > 0

    @property
    def refuted(self) -> np.ndarray:
        """(H,) whether det J is zero or negative somewhere; the remaining hexes are undecided."""
        return self.least <= 0


def certify(vertices: np.ndarray, hexes: np.ndarray) -> Certificate:
    """Bounds of det J of hexes (H, 8), as tight as needed for the sign."""
    parts = [_chunk(vertices, part) for part in np.array_split(hexes, len(hexes) // CHUNK + 1)]
    return Certificate(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def coefficients(corners: np.ndarray) -> np.ndarray:
    """(H, 27) Bernstein coefficients of det J on the unit cube, zeta fastest; corners (H, 8, 3)."""
    values = np.linalg.det(np.einsum("qac,hcd->hqad", _gradients(_GRID), corners, optimize=True))
    return along_axes(values, (_TO_BERNSTEIN,) * 3)


def _chunk(vertices: np.ndarray, hexes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    # reduces rounding errors for a part far from the origin
    corners = vertices[hexes] - vertices[hexes[:, :1]]
    boxes = coefficients(corners)
    mean = np.abs(boxes.mean(axis=1))
    length = np.linalg.norm(corners[:, EDGES[:, 1]] - corners[:, EDGES[:, 0]], axis=2).max(axis=1)
    tiny = ROUNDING * np.maximum(length**3, np.finfo(float).tiny)
    least, bound = signed_bounds(boxes - tiny[:, None], 2)
    return least / np.maximum(mean, tiny), bound / np.maximum(mean, tiny)


def signed_bounds(boxes: np.ndarray, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Smallest value found and lower bound (H,) of polynomials in three variables.

    boxes : (H, (degree + 1)^3) Bernstein coefficients on the unit cube, for the given degree in
        each variable; a box is only halved while the sign is undecided
    """
    octants, ends = halves(degree)
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
        boxes = np.concatenate([along_axes(boxes[is_open], each) for each in octants])
    raise AssertionError("the last level returns")


@lru_cache
def halves(degree: int) -> tuple[list[tuple[np.ndarray, ...]], np.ndarray]:
    """Matrices along the axes for each of the eight halves of a box, and which coefficients are
    values.

    The matrices follow from de Casteljau's algorithm.
    """
    n = degree + 1
    low = np.array([[comb(i, j) / 2**i for j in range(n)] for i in range(n)])
    ends = np.array(list(product((0, degree), repeat=3))) @ [n * n, n, 1]
    return list(product((low, low[::-1, ::-1]), repeat=3)), ends


def along_axes(values: np.ndarray, matrices: tuple[np.ndarray, ...]) -> np.ndarray:
    """Apply an (m, m) matrix along each axis of tensors (n, m^3)."""
    x, y, z = matrices
    cube = values.reshape(-1, len(x), len(x), len(x))
    return np.einsum("nijk,ai,bj,ck->nabc", cube, x, y, z, optimize=True).reshape(values.shape)


def _gradients(at: np.ndarray) -> np.ndarray:
    """(Q, 3, 8) gradients of the trilinear shape functions at parameters (Q, 3)."""
    factors = np.where(PLACES, at[:, None], 1 - at[:, None])  # (Q, 8, 3)
    slopes = np.where(PLACES, 1.0, -1.0)
    return np.stack(
        [np.where(own, slopes, factors).prod(axis=2) for own in np.eye(3, dtype=bool)], axis=1
    )
