"""Pairs of a grid with the shapes of machined parts, a test of what networks do on other shapes.

The polycube of a context gets round holes, fillets, chamfers, slanted planes and drafts
(`cad_shapes`), and slabs of random widths; it is neither smoothed nor bent as in `deformation`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from polycube.diffusion.encoding import box_of, learning_frame, pixels_of
from polycube.diffusion.pairs.cad_shapes import DISCS, CadShapes
from polycube.diffusion.pairs.deformation import Deformation
from polycube.diffusion.pairs.lattices import Feature, Lattice, random_knots
from polycube.diffusion.pairs.pairs import Pair, sampled
from polycube.diffusion.pairs.templates import Context
from polycube.diffusion.pairs.tessellation import Tessellation, exposed, tessellate
from polycube.structure.lattice import boundary, cell_and_wall, genus, lattice


class MachinedPairs:
    """Contexts in turn, each as a random machined part."""

    def __init__(
        self,
        grid: Sequence[int],
        primitives: Mapping[str, np.ndarray],
        contexts: Sequence[Context],
        shapes: CadShapes,
        seed: int,
    ) -> None:
        self.grid, self.contexts, self.primitives = tuple(grid), list(contexts), primitives
        self.shapes, self.seed, self.pads = shapes, seed, False
        self._template = cache(self._made)

    def __call__(self, index: int) -> Pair:
        """Pair number `index` >= 0: points distributed evenly by the area of the geometry."""
        rng, shapes = np.random.default_rng([self.seed, index]), self.shapes
        context = self.contexts[index % len(self.contexts)]
        solid, surface, labels = self._template(context)
        rounds = shapes.round_features(solid, rng)
        knots = random_knots(solid, [each for each in rounds if each.kind in DISCS], rng)
        x = tessellate(solid.occupancy, knots).vertices
        x = shapes.shaped(x, solid, knots, rounds, rng)
        x = learning_frame(x, box=box_of(self.grid, context, self.pads)).apply(x)
        number = len(pixels_of(context, self.pads))
        vertices = x, surface.vertices
        return Pair(*sampled(surface.faces, vertices, labels, number, Deformation(), rng), context)

    def _made(self, context: Context) -> tuple[Lattice, Tessellation, np.ndarray]:
        """The lattice of a context, its surface, and the labels (F, 3) of the triangles."""
        solid = lattice(self.grid, context, self.primitives)
        full = solid.occupancy
        x, y, z = (k - n / 2 for k, n in zip(solid.knots, self.grid, strict=True))
        surface = tessellate(full, (x, y, z))
        axis, box = exposed(full)
        number = full.cumsum().reshape(full.shape) - 1  # of each full box
        faces = replace(boundary(solid), axis=axis, box=number[tuple(box.T)])
        rows = np.stack([axis, *cell_and_wall(solid, faces)], axis=1)
        holes = [
            hole for cell, name in enumerate(context) if name for hole in self._holes(cell, name)
        ]
        labels = rows.repeat(len(surface.faces) // len(rows), axis=0)
        return Lattice(full, holes, genus(solid) or 0), surface, labels

    def _holes(self, cell: int, name: str) -> list[Feature]:
        """The hole through a cell, if its primitive has one."""
        empty = np.argwhere(~self.primitives[name])
        if not len(empty):
            return []
        size = np.array(self.primitives[name].shape)
        low, high = empty.min(axis=0), empty.max(axis=0) + 1
        through = np.flatnonzero(high - low == size)
        if len(through) != 1 or np.prod(high - low) != len(empty):
            return []
        start = size * np.unravel_index(cell, self.grid)
        first, last = (tuple((start + each).tolist()) for each in (low, high))
        return [Feature("hole", first, last, int(through[0]))]
