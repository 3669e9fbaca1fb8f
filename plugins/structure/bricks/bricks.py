"""Build a lattice of bricks from the part, without grid and context.

The knots are where slices of the part change and at its holes. A minimum cut determines the full
bricks, and the cheapest flips of bricks correct the topology. Knots and bricks are then improved
alternately until they are consistent.
"""

from __future__ import annotations

import itertools
import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from polycube.kinds import Structure
from polycube.registry import register
from polycube.structure.primitives import full_cell
from polycube.types import Candidate, Polycube, RoughMap, TriMesh

from .energies import Knots, energies, filled_and_size, largest_genus

if TYPE_CHECKING:
    from ..slices.alignment import View

logger = logging.getLogger(__name__)

Entry = TypeVar("Entry")

TRUST = 0.1  # weight of the misfit in the cost; registration corrects the rest
ROUNDS = 5  # largest number of alternating rounds of knots and bricks


@dataclass(frozen=True, eq=False)
class Bricks:
    """Full bricks between knots, in voxels of a solid."""

    full: np.ndarray  # (X, Y, Z) bool
    knots: Knots
    misfit: float  # voxels in only one of bricks and solid, as a share of the solid

    def cost(self, corner: float) -> float:
        """Cost of misfit and corners; a corner costs `corner`."""
        from .topology import corners

        return self.misfit + corner * corners(self.full)

    @property
    def name(self) -> tuple[tuple[int, ...], bytes]:
        """Key, equal for equal bricks."""
        return self.full.shape, self.full.tobytes()


@register("structure", "bricks")
@dataclass(frozen=True, kw_only=True, eq=False)
class BrickLattice(Structure):
    """Build a lattice of bricks from slices and holes of the part: any genus, no grid needed.

    Parameters
    ----------
    grid : cells of the polycube; not used
    primitives : (3, 3, 3) bool voxels by name
    resolution : voxels along the longest side of the part
    frames : largest number of coordinate frames that are tried
    slabs : largest number of slabs along an axis, before those of holes are added
    apart : smallest length of a slab, as a share of the longest side
    fill : values tried: share of a brick's voxels that must be solid for the brick to be full
    smoothness : values tried: cost per area of the boundary, with the volume as 1
    knots : values tried: cost of an inner knot, as a share of the volume
    corners : values tried: cost of a corner of the bricks, as a share of the volume
    tried : number of divisions that are labelled for each frame and cost of a knot
    mended : largest cost of a flip that corrects the topology, as a share of the volume
    kept : largest number of candidates for each cost of a corner
    """

    any_grid = True

    grid: tuple[int, int, int]
    primitives: Mapping[str, np.ndarray]
    resolution: int = 64
    frames: int = 2
    slabs: int = 7
    apart: float = 0.04
    fill: Sequence[float] = (0.3, 0.5)
    smoothness: Sequence[float] = (0.0, 0.02)
    knots: Sequence[float] = (0.01, 0.03, 0.1)
    corners: Sequence[float] = (0.003, 0.01, 0.03)
    tried: int = 10
    mended: float = 0.1
    kept: int = 2

    def __call__(self, surface: TriMesh, candidates: tuple[Candidate, ...]) -> list[Candidate]:
        """Candidates, cheapest first; empty if no lattice has the genus of the surface."""
        from polycube.surface import measures as surfaces
        from polycube.surface.frames import frames

        brick = full_cell(self.primitives)
        if brick is None:
            logger.info("bricks: no primitive is a full cell; nothing is proposed")
            return []
        genus, found = surfaces.genus(surface), []
        for number, frame in enumerate(frames(surface, self.frames)):
            view = self._view(surface, frame)
            solid = view.voxels.solid[1:-1, 1:-1, 1:-1]
            found += [(bricks, view, number) for bricks in self.lattices(solid, genus)]
        chosen = self._cheapest(found, lambda entry: entry[0], self.kept)
        logger.info("bricks: %d lattices of genus %d", len(found), genus)
        return [self._candidate(*entry, brick) for entry in chosen]

    def _view(self, surface: TriMesh, frame: np.ndarray) -> View:
        """The part in a frame (3, 3), with short axes stretched to half of the longest."""
        from polycube.surface.voxels import voxels

        from ..slices.alignment import View

        sides = np.ptp(surface.vertices @ frame.T, axis=0)
        stretch = np.maximum(1, 0.5 * sides.max() / sides)[:, None]
        solid = voxels(surface, frame * stretch, self.resolution)
        return View(frame / stretch, np.eye(3), solid)

    def lattices(self, solid: np.ndarray, genus: int) -> list[Bricks]:
        """Lattices of bricks of a genus for voxels that touch both ends of each axis."""
        from ..slices.knots import cumulative
        from .cut import minimum_cut
        from .topology import repaired

        counts, apart = cumulative(solid), max(2, round(self.apart * max(solid.shape)))
        made = []
        for knots in self._cuttings(solid, counts, apart, genus):
            for fill, smoothness in itertools.product(self.fill, self.smoothness):
                gain, areas = energies(counts, knots, fill, smoothness)
                full = repaired(minimum_cut(gain, areas), gain, areas, genus, self.mended)
                if full is not None:
                    made.append(self._bricks(full, knots, counts))
        made = self._cheapest(made, lambda bricks: bricks, 2 * self.kept)
        made = [self._refined(bricks, counts, apart, genus) for bricks in made]
        return self._cheapest(made, lambda bricks: bricks, self.kept)

    def _cheapest(
        self, entries: list[Entry], bricks: Callable[[Entry], Bricks], most: int
    ) -> list[Entry]:
        """The first `most` different bricks for each cost of a corner."""
        chosen: dict[object, Entry] = {}
        for corner in self.corners:
            names: set[object] = set()
            for entry in sorted(entries, key=lambda e: bricks(e).cost(corner)):
                name = bricks(entry).name
                if len(names) < most and name not in names:
                    names.add(name)
                    chosen.setdefault(name, entry)
        return list(chosen.values())

    def _cuttings(
        self, solid: np.ndarray, counts: np.ndarray, apart: int, genus: int
    ) -> list[Knots]:
        """Knots of the three axes with the smallest possible misfit of bricks.

        Half of them contain the sides of all holes: without the genus, a small hole is not worth a
        knot.
        """
        from .knots import hole_knots, segment_costs, segmentations

        sides, ends = hole_knots(solid, apart)
        choices: list[list[tuple[np.ndarray, bool]]] = []
        for axis in range(3):
            costs = segment_costs(np.moveaxis(solid, axis, 0))
            plain, holed, ended, both = (
                segmentations(costs, self.slabs, apart, wanted)
                for wanted in ([], sides[axis], ends[axis], [*sides[axis], *ends[axis]])
            )
            has_holes = {tuple(cut): cut for cut in holed}
            others = {
                tuple(cut): cut for cut in plain + ended + both if tuple(cut) not in has_holes
            }
            choices.append([(c, True) for c in has_holes.values()])
            choices[-1] += [(c, False) for c in others.values()]
        cuttings: list[Knots] = []
        misfit, is_holed = [], []
        for choice in itertools.product(*choices):
            knots = [cut for cut, _ in choice]
            if largest_genus(knots) < genus:
                continue
            filled, size = filled_and_size(counts, knots)
            cuttings.append(knots)
            misfit.append(np.minimum(filled, size - filled).sum() / counts[-1, -1, -1])
            is_holed.append(genus > 0 and all(holed for _, holed in choice))
        inner = np.array([sum(map(len, knots)) - 6 for knots in cuttings])
        first: dict[int, None] = {}
        for knot in self.knots:
            order = np.argsort(np.array(misfit) + knot * inner, kind="stable").tolist()
            with_holes = [n for n in order if is_holed[n]][: self.tried // 2]
            first |= dict.fromkeys([*with_holes, *order[: self.tried - len(with_holes)]])
        return [cuttings[number] for number in first]

    def _bricks(self, full: np.ndarray, knots: Knots, counts: np.ndarray) -> Bricks:
        """Bricks without superfluous knots, with their cost."""
        knots_used = []
        for axis in range(3):
            slabs = np.moveaxis(full, axis, 0)
            new = np.append(True, (slabs[1:] != slabs[:-1]).any(axis=(1, 2)))
            full = full.compress(new, axis=axis)
            knots_used.append(knots[axis][np.append(new, True)])
        filled, size = filled_and_size(counts, knots_used)
        misfit = np.where(full, size - filled, filled).sum() / counts[-1, -1, -1]
        return Bricks(full, knots_used, float(misfit))

    def _refined(self, bricks: Bricks, counts: np.ndarray, apart: int, genus: int) -> Bricks:
        """Alternately move knots to the best fit and flip bricks that fit better."""
        from ..slices.knots import descend
        from .topology import repaired

        for _ in range(ROUNDS):
            knots, _ = descend(bricks.full, counts, bricks.knots, apart)
            gain, areas = energies(counts, knots, 0.5, 0.0)
            full = repaired(bricks.full, gain, areas, genus)
            better = bricks if full is None else self._bricks(full, knots, counts)
            if better.misfit >= bricks.misfit:
                return bricks
            bricks = better
        return bricks

    def _candidate(self, bricks: Bricks, view: View, frame: int, brick: str) -> Candidate:
        """The candidate of bricks in the frame with the given number."""
        from polycube.structure.lattice import collapse, of_bricks

        from ..slices.candidates import structure_key

        x, y, z = bricks.knots
        solid = collapse(Polycube(bricks.full, x, y, z, (1, 1, 1), ("bricks",)))
        polycube = of_bricks(solid.occupancy, brick)
        corners = np.stack(np.meshgrid(*[k + 1 for k in solid.knots], indexing="ij"), axis=-1)
        rough_map = RoughMap(*polycube.knots, view.to_model(corners))
        key = structure_key(polycube, np.eye(3), frame)
        return Candidate("bricks", polycube, rough_map, TRUST * bricks.misfit, key)
