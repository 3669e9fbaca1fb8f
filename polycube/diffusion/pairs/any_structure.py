"""Pairs of arbitrary structures: random lattices that resemble parts.

Pair i of a stream depends on (seed, i) only.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from polycube.diffusion.encoding import learning_frame
from polycube.diffusion.pairs.cad_shapes import DISCS, CadShapes
from polycube.diffusion.pairs.deformation import Deformation
from polycube.diffusion.pairs.lattices import random_knots, random_lattice
from polycube.diffusion.pairs.pairs import Points, sampled
from polycube.diffusion.pairs.tessellation import Tessellation, smoothed, tessellate
from polycube.structure.lattice import OUTWARD
from polycube.surface.frames import rotations, turn
from polycube.types import Polycube

STYLES = ("cad", "organic", "both")
UNKNOWN_GENUS = 0.1  # share of pairs without a genus, which is unknown for a noisy scan
CUBE = np.array(list(np.ndindex(2, 2, 2))) * 2.0 - 1  # corners of the box of the learning frame


@dataclass(frozen=True)
class LatticeShapes:
    """Variation of the geometries of random lattices.

    Parameters
    ----------
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
            in_cube = np.concatenate([x, CUBE])
            x = options.deformation.bent(in_cube, rng)[: -len(CUBE)]
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
    vertices = surface.vertices @ rotation.T
    surface = surface._replace(vertices=vertices, axis=axis, knot=knot)
    return replace(part, geometry=part.geometry @ rotation.T, surface=surface, polycube=polycube)
