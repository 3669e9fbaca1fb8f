"""Pairs of arbitrary structures: random lattices that resemble parts.

Pair i of a stream depends on (seed, i) only. The surface of a lattice is small triangles with the
numbers of their knot planes; a few smoothing steps round it, with its bounding box unchanged.
"""

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix

from polycube.diffusion.encoding import learning_frame
from polycube.diffusion.pairs.cad_shapes import DISCS, CadShapes
from polycube.diffusion.pairs.deformation import Deformation
from polycube.diffusion.pairs.lattices import random_knots, random_lattice
from polycube.diffusion.pairs.pairs import Points, sampled
from polycube.structure.lattice import CORNERS, OUTWARD, exposed
from polycube.surface.frames import rotations, turn
from polycube.types import PerAxis, Polycube

STYLES = ("cad", "organic", "both")
UNKNOWN_GENUS = 0.1  # share of pairs without a genus, which is unknown for a noisy scan
CUBE = np.array(list(np.ndindex(2, 2, 2))) * 2.0 - 1  # corners of the box of the learning frame
TRIANGLES = 8000  # largest number; two pieces are always few enough
PIECES = (8, 6, 4, 3, 2)  # numbers of pieces of a slab that are tried
GRADING = 0.5  # 0: equal pieces; towards 1: smaller ones at the knots, for fillets
SHORT = 1e-3  # of the longest edge of the box: lower bound of the length of an edge


class Tessellation(NamedTuple):
    """Triangles of the surface of a lattice, counter-clockwise from outside."""

    vertices: np.ndarray  # (V, 3)
    quads: np.ndarray  # (Q, 4) into vertices, counter-clockwise from outside
    faces: np.ndarray  # (2 Q, 3) indices of vertices: the two triangles of each quad
    axis: np.ndarray  # (2 Q,) 0..5, outward, see types.AXES
    knot: np.ndarray  # (2 Q,) number of the knot on that axis


def tessellate(occupancy: np.ndarray, knots: PerAxis, pieces: int | None = None) -> Tessellation:
    """Surface of boxes (X, Y, Z) between knots, each slab divided into pieces.

    pieces : default: the largest of PIECES with at most TRIANGLES triangles
    """
    axis, box = exposed(occupancy)
    pieces = pieces or next((n for n in PIECES if 2 * len(axis) * n**2 <= TRIANGLES), PIECES[-1])
    shape = pieces * np.array(occupancy.shape) + 1
    at = _corners(axis, box, pieces)  # (Q, n, n, 4, 3)
    number = np.ravel_multi_index(np.moveaxis(at, -1, 0), shape).reshape(-1, 4)
    is_used = np.zeros(np.prod(shape), bool)
    is_used[number] = True
    index = np.unravel_index(np.flatnonzero(is_used), shape)
    nodes = [cut(each, pieces) for each in knots]
    vertices = np.stack([n[i] for n, i in zip(nodes, index, strict=True)], axis=1)
    quads = (np.cumsum(is_used) - 1)[number]
    plane = box[np.arange(len(axis)), axis // 2] + 1 - axis % 2
    labels = axis.repeat(2 * pieces**2), plane.repeat(2 * pieces**2)
    return Tessellation(vertices, quads, quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3), *labels)


def cut(knots: np.ndarray, pieces: int) -> np.ndarray:
    """Knots after dividing the slabs between them into pieces that are smaller near the knots."""
    t = np.arange(pieces) / pieces
    t = t - GRADING * np.sin(2 * np.pi * t) / (2 * np.pi)
    return np.append(knots[:-1, None] + np.diff(knots)[:, None] * t, knots[-1])


def _corners(axis: np.ndarray, box: np.ndarray, pieces: int) -> np.ndarray:
    """(Q, n, n, 4, 3) indices of the corners of the n x n pieces of box faces."""
    corner = np.broadcast_to(CORNERS[axis][:, None, None], (len(axis), pieces, pieces, 4, 3))
    piece = np.zeros((3, pieces, pieces, 3), np.int64)  # position of a piece, for each axis
    for normal in range(3):
        across = np.delete(np.arange(3), normal)
        piece[normal][..., across] = np.moveaxis(np.indices((pieces, pieces)), 0, -1)
    scale = np.where(np.arange(3) == axis[:, None] // 2, pieces, 1)[:, None, None, None]
    return pieces * box[:, None, None, None] + piece[axis // 2][:, :, :, None] + scale * corner


def smoothed(vertices: np.ndarray, quads: np.ndarray, steps: int) -> np.ndarray:
    """(V, 3) vertices after `steps` moves halfway to the mean of their neighbours.

    Neighbours are the other ends of the edges of the quads (Q, 4), where each edge belongs to two
    quads, with the inverse length of the edge as weight. Points on a flat face hardly move along
    it.
    """
    low, extent = vertices.min(axis=0), np.ptp(vertices, axis=0)
    n = len(vertices)
    a, b = quads.ravel(), np.roll(quads, -1, axis=1).ravel()  # each edge once in each direction
    lengths = np.linalg.norm(vertices[a] - vertices[b], axis=1)
    weights = 1 / np.maximum(lengths, SHORT * extent.max())
    near, total = csr_matrix((weights, (a, b)), shape=(n, n)), np.bincount(a, weights, n)
    x = vertices
    for _ in range(steps):
        x = (x + near @ x / total[:, None]) / 2
    return (x - x.min(axis=0)) / np.ptp(x, axis=0) * extent + low


@dataclass(frozen=True)
class LatticeShapes:
    """Variation of the geometries of random lattices.

    cad, organic : share of parts with CAD features only, and share of deformed parts only; the
        others have both
    smoothing : largest number of smoothing steps of the deformed parts
    shapes : CAD features of a part
    deformation : deformation of a part; its rounding, warp and stretch are not used, because the
        polycube has the widths of the part, and `smoothing` rounds it
    """

    cad: float = 0.6
    organic: float = 0.2
    smoothing: int = 80
    shapes: CadShapes = field(default_factory=CadShapes)
    deformation: Deformation = field(
        default_factory=lambda: Deformation(
            rounding=0, warp=0, stretch=0, disc=0.5, profile=0.12, waves=0.04, bend=0.25
        )
    )

    def style(self, rng: np.random.Generator) -> str:
        """A random one of STYLES."""
        return str(rng.choice(STYLES, p=[self.cad, self.organic, 1 - self.cad - self.organic]))


@dataclass(frozen=True, eq=False)
class Part:
    """A geometry and its polycube with common triangles, both in the learning frame."""

    geometry: np.ndarray  # (V, 3)
    # surface of the polycube; its triangles are those of the geometry as well
    surface: Tessellation
    polycube: Polycube
    genus: int
    style: str


@dataclass(frozen=True, eq=False)
class LatticePair(Points):
    """Points of a lattice; the labels are the outward axis 0..5 and the knot number on it."""

    solid: Polycube  # collapsed
    genus: int | None  # genus as input of the network; None for a share UNKNOWN_GENUS of the pairs


class LatticePairs:
    """Random lattices with random shapes: an endless stream of pairs with n_points each.

    views : number of consecutive pairs of one part, because a part takes most of the time; all but
        the first are rotated by a random rotation of the cube, and each has its own points
    """

    def __init__(
        self, seed: int, n_points: int, options: LatticeShapes | None = None, views: int = 1
    ) -> None:
        self.seed, self.n_points, self.options = seed, n_points, options or LatticeShapes()
        self.views = views
        self._cached: tuple[int, Part] | None = None

    def __call__(self, index: int) -> LatticePair:
        """Pair number `index` >= 0: points distributed evenly by the area of the geometry."""
        number, view = divmod(index, self.views)
        if self._cached is None or self._cached[0] != number:
            self._cached = number, self.part(number)
        part, rng = self._cached[1], np.random.default_rng([self.seed, number, view])
        if view:
            part = turned(part, rotations()[rng.integers(24)])
        labels = np.stack([part.surface.axis, part.surface.knot], axis=1)
        surfaces, noise = (part.geometry, part.surface.vertices), self.options.deformation
        drawn = sampled(part.surface.faces, surfaces, labels, self.n_points, noise, rng)
        genus = None if rng.random() < UNKNOWN_GENUS else part.genus
        return LatticePair(*drawn, part.polycube, genus)

    def part(self, index: int) -> Part:
        """The surfaces of part number `index`: without other views, of the pair of that number."""
        rng, options = np.random.default_rng([self.seed, index]), self.options
        style = options.style(rng)
        lattice = random_lattice(rng)
        rounds = [] if style == "organic" else options.shapes.round_features(lattice, rng)
        knots = random_knots(lattice, [each for each in rounds if each.kind in DISCS], rng)
        surface = tessellate(lattice.occupancy, knots)
        x = surface.vertices
        if style != "organic":
            x = options.shapes.shaped(x, lattice, knots, rounds, rng)
        if style != "cad":
            x = smoothed(x, surface.quads, int(rng.integers(options.smoothing + 1)))
            # so that thin and thick parts are bent in the same way
            x = options.deformation.bent(np.concatenate([x, CUBE]), rng)[: -len(CUBE)]
        polycube = Polycube(lattice.occupancy, *knots, (1, 1, 1), ("lattice",))
        return Part(learning_frame(x).apply(x), surface, polycube, lattice.genus, style)


def turned(part: Part, rotation: np.ndarray) -> Part:
    """A part rotated by one of the rotations (3, 3) of the cube."""
    old, surface = part.polycube, part.surface
    axis = (OUTWARD @ rotation.T @ OUTWARD.T).argmax(axis=1)[surface.axis]
    last = np.array(old.occupancy.shape)[surface.axis // 2]
    knot = np.where(axis % 2 == surface.axis % 2, surface.knot, last - surface.knot)
    from_axis, sign = np.abs(rotation).argmax(axis=1), rotation.sum(axis=1)
    x, y, z = (np.sort(sign[a] * old.knots[from_axis[a]]) for a in range(3))
    polycube = Polycube(turn(old.occupancy, rotation), x, y, z, old.grid, old.context)
    surface = surface._replace(vertices=surface.vertices @ rotation.T, axis=axis, knot=knot)
    return replace(part, geometry=part.geometry @ rotation.T, surface=surface, polycube=polycube)
