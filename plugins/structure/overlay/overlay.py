"""A lattice as fine as the hexes, overlaid on the part."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256

import numpy as np

from polycube.hexmesh.settings import MeshingSettings
from polycube.kinds import Structure
from polycube.registry import register, setting
from polycube.types import OVERLAY, Candidate, Polycube, RoughMap, TriMesh

logger = logging.getLogger(__name__)

SMALLER = 0.87  # ratio of cells that makes one more candidate worth while
SAMPLES = 4  # of a cell along each axis
MOST_CELLS = 2_000_000  # full or not: their samples take 130 MB


@register("structure", "overlay")
@dataclass(frozen=True, kw_only=True, eq=False)
class Overlay(Structure):
    """Fill the cells of a lattice that lie in the part.

    Topology is always that of the part: cells are flipped, or the lattice is finer.  Hexes are as
    large as the cells: many more than on a coarse polycube, and room for more features.

    Parameters
    ----------
    grid : cells of the polycube; not used
    primitives : (3, 3, 3) bool voxels by name
    size : of the hexes, in the units of the part or as a share of the diagonal
    finer : times by which cells are smaller than that; one candidate each
    finest : the same of one more candidate at most, as fine as walls and holes want
    across_wall, around_hole : hexes that these want
    steps : by which they are smaller yet until the topology is right
    least : shares of a cell that must be solid for it to be full, tried in this order
    max_hexes : full cells at most; a lattice that needs more is not proposed
    """

    any_grid = True

    grid: tuple[int, int, int]
    primitives: Mapping[str, np.ndarray]
    size: float | str = setting("meshing.size", MeshingSettings.size)
    finer: Sequence[float] = (2.0, 3.3)
    finest: float = 5.0
    across_wall: float = setting("meshing.across_wall", MeshingSettings.across_wall)
    around_hole: float = setting("meshing.around_hole", MeshingSettings.around_hole)
    steps: Sequence[float] = (1.0, 1.15, 1.3, 1.6, 2.0)
    least: Sequence[float] = (0.5, 0.35, 0.65)
    max_hexes: int = setting("meshing.max_hexes", MeshingSettings.max_hexes)

    def __call__(self, surface: TriMesh, candidates: tuple[Candidate, ...]) -> list[Candidate]:
        """Candidates, the coarsest first; none where no lattice has the topology of the part."""
        from polycube.hexmesh.generation import sizing
        from polycube.surface.frames import frames
        from polycube.surface.measures import diagonal

        brick = next((name for name, voxels in self.primitives.items() if voxels.all()), None)
        if brick is None:
            logger.info("overlay: no primitive is a full cell; nothing proposed")
            return []
        frame = frames(surface, 1)[0]
        size = sizing.length(self.size, diagonal(surface))
        made = (self._candidate(surface, frame, cell, brick) for cell in self._cells(surface, size))
        return [candidate for candidate in made if candidate is not None]

    def _cells(self, surface: TriMesh, size: float) -> list[float]:
        """Sizes of the cells of the candidates, the largest first."""
        from polycube.surface.feature_size import detail_size
        from polycube.surface.fit_target import target

        goal = target(surface)
        cells = sorted((size / finer for finer in self.finer), reverse=True)
        wanted = detail_size(goal, self.across_wall, self.around_hole) * goal.scale
        least = max(wanted, size / self.finest)
        return [*cells, least] if least < SMALLER * min(cells, default=size) else cells

    def _candidate(
        self, surface: TriMesh, frame: np.ndarray, size: float, brick: str
    ) -> Candidate | None:
        """The first lattice of about that size whose topology is right."""
        from polycube.structure.lattice import genus
        from polycube.surface import measures

        from .planes import planes
        from .topology import manifold

        wanted = measures.genus(surface)
        turned = TriMesh(surface.vertices @ frame.T, surface.faces)
        for step in self.steps:
            if measures.volume(surface) > self.max_hexes * (size / step) ** 3:
                logger.info("overlay: more than %d cells of size %.4g", self.max_hexes, size / step)
                return None
            x, y, z = (planes(turned, axis, size / step) for axis in range(3))
            if len(x) * len(y) * len(z) > MOST_CELLS:
                logger.info("overlay: too many cells of size %.4g round the part", size / step)
                return None
            share = _solid_shares(turned, x, y, z)
            for least in self.least:
                full = manifold(share, least)
                polycube = _polycube(full, brick)
                found = genus(polycube)
                logger.info(
                    "overlay: %d full cells of size %.4g, genus %d of %d",
                    full.sum(),
                    size / step,
                    found,
                    wanted,
                )
                if found == wanted:
                    corners = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1)
                    rough_map = RoughMap(*polycube.knots, corners @ frame)
                    key = f"overlay {sha256(full.tobytes()).hexdigest()}"
                    return Candidate("overlay", polycube, rough_map, 0.0, key, family=OVERLAY)
        return None


def _solid_shares(surface: TriMesh, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """(X, Y, Z) share of each cell between lattice planes that is solid, by samples."""
    from polycube.surface.inside import inside

    solid = inside(surface.vertices[surface.faces], *map(_samples, (x, y, z)))
    nx, ny, nz = (len(planes) - 1 for planes in (x, y, z))
    return solid.reshape(nx, SAMPLES, ny, SAMPLES, nz, SAMPLES).mean(axis=(1, 3, 5))


def _samples(planes: np.ndarray) -> np.ndarray:
    """Of every interval, evenly."""
    inner = (np.arange(SAMPLES) + 0.5) / SAMPLES
    return (planes[:-1, None] + np.diff(planes)[:, None] * inner).ravel()


def _polycube(full: np.ndarray, brick: str) -> Polycube:
    """Of the full cells, each a grid cell."""
    x, y, z = (np.arange(n + 1.0) for n in full.shape)
    context = tuple(brick if is_full else None for is_full in full.ravel().tolist())
    return Polycube(full, x, y, z, full.shape, context)
