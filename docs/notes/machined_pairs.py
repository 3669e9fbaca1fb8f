"""What a network does on other shapes than those of its training: on machined parts.

    python docs/notes/machined_pairs.py OUTPUT [OVERRIDES ...]

evaluates the included weights as `python -m polycube.evaluate` does, with the same overrides, on
pairs of the same contexts with plane faces, round holes, slots, fillets, chamfers and drafts.  No
network was trained on them.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from polycube.cli.evaluate import evaluate_weights
from polycube.config import compose
from polycube.diffusion.pairs.cad_shapes import DISCS, CadShapes
from polycube.diffusion.pairs.deformation import Deformation
from polycube.diffusion.pairs.lattices import Feature, Lattice, random_knots
from polycube.diffusion.pairs.pairs import Pairs
from polycube.diffusion.pairs.templates import Context, Template, contexts
from polycube.registry import register
from polycube.structure.lattice import genus, lattice


class MachinedPairs(Pairs):
    """Contexts in turn, each as a random machined part.

    The polycube of a context gets round holes, fillets, chamfers, slanted planes and drafts
    (`cad_shapes`), and slabs of random widths. The deformation is noise only.
    """

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


class Machined:
    """A data plugin: polycubes of all contexts of the grid with the shapes of machined parts."""

    def __call__(
        self, grid: Sequence[int], primitives: Mapping[str, np.ndarray], seed: int
    ) -> MachinedPairs:
        """The stream; pairs are computed by their number."""
        return MachinedPairs(grid, primitives, contexts(grid, primitives), seed)


if __name__ == "__main__":
    register("data", "machined")(Machined)
    settings = compose("evaluate", sys.argv[2:])
    evaluate_weights({**settings, "data": {"plugin": "machined"}}, Path(sys.argv[1]))
