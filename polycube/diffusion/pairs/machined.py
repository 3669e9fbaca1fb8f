"""Pairs of a grid with the shapes of machined parts, a test of what networks do on other shapes.

The polycube of a context gets round holes, fillets, chamfers, slanted planes and drafts
(`cad_shapes`), and slabs of random widths; it is neither smoothed nor bent as in `deformation`.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from polycube.diffusion.pairs.cad_shapes import DISCS, CadShapes
from polycube.diffusion.pairs.deformation import Deformation
from polycube.diffusion.pairs.lattices import Feature, Lattice, random_knots
from polycube.diffusion.pairs.pairs import Pairs
from polycube.diffusion.pairs.templates import Context, Template
from polycube.structure.lattice import genus, lattice


class MachinedPairs(Pairs):
    """Contexts in turn, each as a random machined part; the deformation is noise only."""

    def __init__(
        self,
        grid: Sequence[int],
        primitives: Mapping[str, np.ndarray],
        contexts: Sequence[Context],
        seed: int,
    ) -> None:
        super().__init__(grid, primitives, contexts, Deformation(), seed)
        self.primitives, self.shapes = primitives, CadShapes()

    def shape(self, context: Context, rng: np.random.Generator) -> tuple[Template, np.ndarray]:
        """The polycube of a context, and the places (V, 3) of its vertices on a random part."""
        template, solid = self._template(context), self._lattice(context)
        rounds = self.shapes.round_features(solid, rng)
        knots = random_knots(solid, [each for each in rounds if each.kind in DISCS], rng)
        even = (np.linspace(-n / 2, n / 2, len(k)) for n, k in zip(self.grid, knots, strict=True))
        moved = map(np.interp, template.vertices.T, even, knots)
        x = np.stack(list(moved), axis=1)
        return template, self.shapes.shaped(x, solid, knots, rounds, rng)

    def _lattice(self, context: Context) -> Lattice:
        """The boxes of a context, and the holes through its cells."""
        solid = lattice(self.grid, context, self.primitives)
        holes = [
            hole for cell, name in enumerate(context) if name for hole in self._holes(cell, name)
        ]
        return Lattice(solid.occupancy, holes, genus(solid))

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
