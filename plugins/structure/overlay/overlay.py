"""A lattice with cells of the size of the hexes, laid over the part."""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from itertools import product
from typing import ClassVar

import numpy as np

from polycube.hexmesh.generation import sizing
from polycube.hexmesh.generation.requests import requests_of
from polycube.hexmesh.settings import edges_around
from polycube.kinds import Structure
from polycube.registry import register, setting
from polycube.structure.primitives import OnGrid, full_cell
from polycube.surface import measures
from polycube.surface.measures import diagonal, volume
from polycube.types import Candidate, RoughMap, Tier, TriMesh

logger = logging.getLogger(__name__)

MARGIN = 1.05  # factor on the smallest cells that `max_hexes` permits
SMALLER = 0.87  # largest ratio of cells for another candidate
SAMPLES = 4  # of a cell along each axis
COVERED = 0.8  # of the solid: smallest share that a lattice must contain
MOST_CELLS = 2_000_000  # full or empty: their samples take 130 MB
Defects = tuple[bool, int]  # whether parts are missing, and the difference of the genus


@register("structure", "overlay")
@dataclass(frozen=True, kw_only=True, eq=False)
class Overlay(OnGrid, Structure):
    """Fill the cells of a lattice inside the part.

    The topology is that of the part: cells are flipped, or the lattice is refined. If no lattice
    has it, the one with the closest genus is a substitute. Hexes have the size of the cells: there
    are many more than on a coarse polycube, with room for more features.

    Parameters
    ----------
    size : wanted edge length of the hexes, in the units of the part or as a share of the diagonal
    finer : factors by which the cells are smaller than the size; one candidate for each
    finest : largest factor of one more candidate, whose cells are as small as walls and holes
        require
    most : largest number of full cells, of all candidates but the coarsest; sheets add to the hexes
    across_wall : smallest number of hexes through a wall
    around_hole : smallest number of edges round a hole
    at : numbers of hexes at faces of the part, as `meshing.at`; the cells of the first candidate
        are as small as these require, where `max_hexes` allows
    steps : factors by which the cells are made smaller until the topology is correct
    least : shares of a cell that must be solid for it to be full, tried in this order
    thin : smaller shares, tried if no lattice has the right topology, because a thin sheet fills
        only a small share of its cells
    max_hexes : largest number of full cells; a lattice that needs more is not proposed
    """

    references: ClassVar[tuple[str, ...]] = ("schneiders1996grid", "mitchell1995pillowing")

    tier = Tier.FINE
    any_grid = True

    size: float | str = setting("meshing.size")
    finer: Sequence[float] = (2.0, 3.3)
    finest: float = 5.0
    most: int = 40_000
    across_wall: float = setting("meshing.across_wall")
    around_hole: float | str = setting("meshing.around_hole")
    at: Sequence[object] = setting("meshing.at")
    steps: Sequence[float] = (1.0, 1.15, 1.3, 1.6, 2.0)
    least: Sequence[float] = (0.5, 0.35, 0.65)
    thin: Sequence[float] = (0.2, 0.05)
    max_hexes: int = setting("meshing.max_hexes")

    def __call__(self, surface: TriMesh, candidates: tuple[Candidate, ...]) -> list[Candidate]:
        """Candidates, the coarsest first, or as fine as `at` requires.

        If no lattice has the correct topology, there is one substitute.
        """
        from polycube.surface.frames import frames

        brick = full_cell(self.primitives)
        if brick is None:
            logger.info("overlay: no primitive is a full cell; nothing is proposed")
            return []
        frame = frames(surface)[0]
        size = sizing.length(self.size, diagonal(surface))
        sizes = self._sizes(surface, size)
        found = [_first(self._lattices(surface, frame, size, cell, brick)) for cell in sizes]
        made = [each for each in found if each is not None]
        correct = [candidate for defects, candidate in made if not any(defects)]
        if correct or not made:
            return correct
        (_, off), nearest = min(made, key=lambda each: each[0])
        message = "overlay: no lattice has the right topology; the genus differs by %d or more"
        logger.info(message, off)
        return [replace(nearest, tier=Tier.LAST)]

    def __post_init__(self) -> None:
        requests_of(self.at)

    def _sizes(self, surface: TriMesh, size: float) -> list[float]:
        """Sizes of the cells of the candidates.

        With entries of `at`, first those that are as small as these require, within `max_hexes`;
        then larger ones, in case these give no good mesh.
        """
        from polycube.hexmesh.generation.requests_met import wanted_sizes

        cells = self._cells(surface, size)
        if not self.at:
            return cells
        wanted = wanted_sizes(surface, requests_of(self.at)).sizes.min() * diagonal(surface)
        largest = float(max(wanted, MARGIN * (volume(surface) / self.max_hexes) ** (1 / 3)))
        fine = [cell for cell in cells if cell <= largest] or [largest]
        return [*fine, *(cell for cell in reversed(cells) if cell > largest)]

    def _cells(self, surface: TriMesh, size: float) -> list[float]:
        """Sizes of the cells of the candidates, the largest first."""
        from polycube.surface.feature_size import detail_size
        from polycube.surface.fit_target import target

        goal = target(surface)
        first, *others = sorted((size / times for times in self.finer), reverse=True) or [size]
        smallest = min((volume(surface) / self.most) ** (1 / 3), first)
        cells = sorted({first, *(max(cell, smallest) for cell in others)}, reverse=True)
        wanted = detail_size(goal, self.across_wall, edges_around(self.around_hole)) * goal.scale
        least = max(wanted, size / self.finest, smallest)
        return [*cells, least] if least < SMALLER * cells[-1] else cells

    def _lattices(
        self, surface: TriMesh, frame: np.ndarray, size: float, cell: float, brick: str
    ) -> Iterator[tuple[Defects, Candidate]]:
        """Lattices with cells of about that size, each after its defects.

        size : size of the largest hexes into which they may be merged
        """
        from polycube.structure.lattice import genus, of_bricks
        from polycube.surface.voxels import inside

        from .planes import manifold, planes

        wanted = measures.genus(surface)
        turned = TriMesh(surface.vertices @ frame.T, surface.faces)
        part = (np.arange(SAMPLES) + 0.5) / SAMPLES  # of a cell
        for shares, step in product((self.least, self.thin), self.steps):
            edge = cell / step
            if volume(surface) > self.max_hexes * edge**3:
                logger.info("overlay: more than %d cells of size %.4g", self.max_hexes, edge)
                continue
            x, y, z = (planes(turned, a, edge, sizing.doublings(size, edge)) for a in range(3))
            if len(x) * len(y) * len(z) > MOST_CELLS:
                message = "overlay: the grid of cells of size %.4g around the part is too large"
                logger.info(message, edge)
                continue
            samples = ((p[:-1, None] + np.diff(p)[:, None] * part).ravel() for p in (x, y, z))
            solid = inside(turned.vertices[turned.faces], *samples)
            shape = (len(x) - 1, SAMPLES, len(y) - 1, SAMPLES, len(z) - 1, SAMPLES)
            share = solid.reshape(shape).mean(axis=(1, 3, 5))  # solid share of each cell
            for full in (manifold(share, least) for least in shares):
                if not full.any():
                    continue
                polycube = of_bricks(full, brick)
                found, number = genus(polycube), full.sum()
                message = "overlay: %d full cells of size %.4g, genus %d of %d"
                logger.info(message, number, edge, found, wanted)
                corners = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1)
                rough_map = RoughMap(*polycube.knots, corners @ frame)
                key = f"overlay {sha256(full.tobytes()).hexdigest()}"
                candidate = Candidate(
                    "overlay", polycube, rough_map, 0.0, key, tier=self.tier, variants="overlay"
                )
                is_incomplete = bool(share[full].sum() < COVERED * share.sum())
                yield (is_incomplete, abs(found - wanted)), candidate


def _first(lattices: Iterator[tuple[Defects, Candidate]]) -> tuple[Defects, Candidate] | None:
    """The first lattice without defects, else the first with the fewest."""
    best = None
    for each in lattices:
        if best is None or each[0] < best[0]:
            best = each
        if not any(each[0]):
            break
    return best
