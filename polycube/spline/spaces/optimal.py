"""Cubic splines on an unstructured hex mesh, C2 except at cut faces and their ends.

The boundary and the faces at which the mesh has no product structure (`cuts`) are cut, as by a
threefold knot: functions are only continuous there. In some directions, a Bezier node is an
independent value; in the others, the splined directions, it follows from two coefficients as in a
uniform B-spline. Where a cut ends, the hexes around a node differ in a direction, and the node is
not splined in it. A coefficient is identified by the Bezier node closest to it and its splined
directions.

The rows are convex weights. A node between the sides of a hex is, in each splined direction, one of
two nodes that determine two coefficients, so the functions are linearly independent. They span all
tricubic polynomials on each hex. A function is C2 across a face if all nodes of the face are
splined across it. The other faces are cut when the mesh is refined, so that the finer space
contains the coarser one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix

from polycube.spline.spaces.continuous import ContinuousSpace
from polycube.spline.spaces.cuts import HalfEdges, children, cut_faces
from polycube.spline.spaces.extraction import NO_INDICES
from polycube.spline.spaces.sharp_features import union
from polycube.types import HexMesh

STEP = np.array([1, 4, 16])  # between nodes along each axis
PLACE = np.arange(64)[:, None] // STEP % 4  # (64, 3) position of each node
FAR = PLACE // 2  # (64, 3) closer side of the hex
CORNER = FAR @ [1, 2, 4]  # (64,) closest tensor corner
BETWEEN = PLACE % 3 > 0  # (64, 3) not on a side of the hex
AXES = np.arange(3)

# Weight of the closer one of two coefficients, and the positions of both, along a line of four
# nodes. First index: not splined, else 1 + (low side cut) + 2 (high side cut).
_NEARER = np.ones((5, 4))
_PLACES = np.stack([np.tile(np.arange(4), (5, 1))] * 2, axis=-1)  # (5, 4, 2)
_NEARER[1], _PLACES[1] = 2 / 3, [[0, 3], [0, 3], [3, 0], [3, 0]]
_NEARER[2], _PLACES[2] = [1, 1, 0.5, 0.5], [[0, 0], [1, 1], [3, 1], [3, 1]]
_NEARER[3], _PLACES[3] = [0.5, 0.5, 1, 1], [[0, 2], [0, 2], [2, 2], [3, 3]]
RINGS = 2, None  # lengths of the continuation of cuts, see `cut_faces`


def smallest_space(
    mesh: HexMesh,
    points: np.ndarray,
    sharp_edges: np.ndarray,
    corner_vertices: np.ndarray = NO_INDICES,
    straight: np.ndarray = NO_INDICES,
) -> OptimalSpace:
    """The space with the smallest number of functions, among those of longer and shorter cuts.

    points : (B, 3) Bezier points of `volumetric_spline` with the same sharp edges, corners and
        straight hexes
    """
    tips = union(np.asarray(corner_vertices, np.int64), mesh.hexes[straight].ravel())
    short, long = (cut_faces(mesh, sharp_edges, tips, rings) for rings in RINGS)
    space = OptimalSpace(mesh, points, long)
    if np.array_equal(short, long):
        return space
    return min(OptimalSpace(mesh, points, short), space, key=lambda space: space.size)


@dataclass(frozen=True, eq=False)
class OptimalSpace(ContinuousSpace):
    """The functions that are compatible with some cut faces."""

    cut: np.ndarray  # (H, 6) sides of hexes across which functions are only continuous

    @cached_property
    def _near(self) -> np.ndarray:
        """(H, 64, 3) whether the side closer to each node is cut."""
        return self.cut[:, 2 * AXES + FAR]

    @cached_property
    def _far(self) -> np.ndarray:
        """(H, 64, 3) whether the opposite side is cut."""
        return self.cut[:, 2 * AXES + 1 - FAR]

    @cached_property
    def _directions(self) -> tuple[np.ndarray, np.ndarray]:
        """(H, 8, 3) bits of the line and of the half-edge along each axis from each corner.

        Bits are numbered at each vertex; the two half-edges of a line share the bit of the line.
        """
        half = HalfEdges.of(self.mesh.hexes)
        line = half.classes(~self.cut.ravel()[half.pairs[:, 0]])
        first = np.searchsorted(half.vertex, half.vertex)
        own = np.int64(1) << (np.arange(len(first)) - first)
        return own[line][half.number], own[half.number]

    @cached_property
    def _splined(self) -> np.ndarray:
        """(H, 64, 3) the directions in which each node is splined."""
        line, own = (bits[:, CORNER] for bits in self._directions)
        near, far = self._near, self._far
        inner = BETWEEN | ~near
        rounds = _Rounds(self.nodes)
        lines = _together(line * inner)
        agree = rounds.all(lines) == rounds.any(lines)
        for bits, flag in ((line * inner, near), (own * inner, far)):
            agree &= rounds.clashes(bits, flag) == 0
        along = line * BETWEEN
        is_splined = rounds.any(_together(along))
        for flag in (near, far):
            is_splined &= ~rounds.clashes(along, flag)
        return inner & (line & np.where(agree, rounds.any(lines), is_splined)[self.nodes, None] > 0)

    @cached_property
    def _terms(self) -> _Terms:
        splined, nodes = self._splined, self.nodes
        state = np.where(splined, 1 + self.cut[:, None, ::2] + 2 * self.cut[:, None, 1::2], 0)
        nearer = _NEARER[state, PLACE]
        weights = _products(nearer, 1 - nearer).ravel()
        entry = np.flatnonzero(weights)
        place, term = np.divmod(entry, 8)
        first = place // 64 * 64  # index of the first node of the hex
        at = _sums(_PLACES[state, PLACE]).ravel()[entry]
        line, _ = self._directions
        there = line.reshape(-1, 3)[first // 8 + CORNER[at]]
        mask = _together(there * splined.reshape(-1, 3)[place])
        names = (nodes.ravel()[first + at] << int(mask.max()).bit_length()) | mask
        distinct, coefficient = np.unique(names, return_inverse=True)
        return _Terms(place, term, coefficient, weights[entry], len(distinct))

    @property
    def size(self) -> int:
        """Number of functions."""
        return self._terms.size

    @cached_property
    def extraction(self) -> csr_matrix:
        """(B, C) rows of all Bezier nodes, each the mean over the hexes around it."""
        terms, count = self._terms, np.bincount(self.nodes.ravel())
        node = self.nodes.ravel()[terms.place]
        weight = terms.weight / count[node]
        return csr_matrix((weight, (node, terms.coefficient)), (len(count), terms.size))

    @cached_property
    def inverse(self) -> csr_matrix:
        """(C, B) coefficients of a function of the space from its Bezier nodes.

        Each is computed from the nodes of one hex.
        """
        terms = self._terms
        between = (BETWEEN | ~self._splined).all(axis=-1).ravel()[terms.place]
        chosen = np.flatnonzero((terms.term == 0) & between)
        wanted, first = np.unique(terms.coefficient[chosen], return_index=True)
        hexes, node = np.divmod(terms.place[chosen[first]], 64)
        extrapolated = (self._splined & ~self._near)[hexes, node]  # 2 near - far, else near
        weights = _products(1.0 + extrapolated, -1.0 * extrapolated)
        at = _sums(np.stack([PLACE[node], 3 - PLACE[node]], axis=-1))
        columns = self.nodes[hexes[:, None], at].ravel()
        shape = len(wanted), self.nodes.max() + 1
        inverse = csr_matrix((weights.ravel(), columns, np.arange(len(wanted) + 1) * 8), shape)
        inverse.eliminate_zeros()
        return inverse

    @cached_property
    def control(self) -> np.ndarray:
        """(C, 3) coefficients of the geometry."""
        return self.inverse @ self.points

    @cached_property
    def smooth(self) -> np.ndarray:
        """(H, 6) sides of hexes across which every function is C2."""
        sides = [(PLACE[:, axis] == 3 * side, axis) for axis in range(3) for side in range(2)]
        return np.stack([self._splined[:, on, axis].all(axis=1) for on, axis in sides], axis=1)

    def finer(self, elements: np.ndarray) -> tuple[OptimalSpace, csr_matrix]:
        """The space of the children of some hexes, 8 i to 8 i + 7, and the two-scale matrix.

        It contains this space: all faces across which this space is not C2 are cut, and the C2
        functions of a divided hex follow from uniform ones. At the rim of the elements, the mesh is
        treated as if it continued.
        """
        mesh, halves = self.halved(elements)
        fine = OptimalSpace(mesh, halves @ self.points, children(~self.smooth[elements]))
        return fine, fine.inverse @ halves @ self.extraction


class _Terms(NamedTuple):
    """Contributions of each hex to its nodes: sums of weighted coefficients."""

    place: np.ndarray  # (N,) 64 hex + node
    term: np.ndarray  # (N,) 0 to 7: choice of one of two coefficients along each axis
    coefficient: np.ndarray  # (N,)
    weight: np.ndarray  # (N,)
    size: int  # number of coefficients


class _Rounds:
    """The hexes around each Bezier node."""

    def __init__(self, nodes: np.ndarray) -> None:
        """nodes : (H, 64)"""
        self._order = np.argsort(nodes.ravel(), kind="stable")
        self._start = np.searchsorted(nodes.ravel()[self._order], np.arange(nodes.max() + 1))

    def any(self, bits: np.ndarray) -> np.ndarray:
        """(B,) the bits that any of the hexes has; bits (H, 64)."""
        return np.bitwise_or.reduceat(bits.ravel()[self._order], self._start)

    def all(self, bits: np.ndarray) -> np.ndarray:
        """(B,) the bits that all the hexes have; bits (H, 64)."""
        return np.bitwise_and.reduceat(bits.ravel()[self._order], self._start)

    def clashes(self, bits: np.ndarray, flag: np.ndarray) -> np.ndarray:
        """(B,) the bits (H, 64, 3) for which hexes that have them differ in the flag."""
        return self.any(_together(bits * flag)) & self.any(_together(bits * ~flag))


def _together(bits: np.ndarray) -> np.ndarray:
    """(...) the bits along all three axes, (..., 3)."""
    return bits[..., 0] | bits[..., 1] | bits[..., 2]


def _products(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(..., 8) products over the axes of the first or the second weight, each (..., 3)."""
    pair = np.stack([first, second], axis=-1)
    x, y, z = (pair[..., axis, :] for axis in range(3))
    product = x[..., :, None, None] * y[..., None, :, None] * z[..., None, None, :]
    return product.reshape(*pair.shape[:-2], 8)


def _sums(places: np.ndarray) -> np.ndarray:
    """(..., 8) nodes of a hex from the first or the second position on each axis, (..., 3, 2)."""
    x, y, z = (places[..., axis, :] * STEP[axis] for axis in range(3))
    node = x[..., :, None, None] + y[..., None, :, None] + z[..., None, None, :]
    return node.reshape(*places.shape[:-2], 8)
