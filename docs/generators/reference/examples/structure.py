from dataclasses import dataclass

import numpy as np

from polycube.kinds import Structure
from polycube.registry import register
from polycube.structure.primitives import OnGrid
from polycube.types import Candidate, Polycube, Tier, TriMesh


@register("structure", "bar")
@dataclass(frozen=True, kw_only=True, eq=False)
class Bar(OnGrid, Structure):
    """One box over the bounding box, for parts without holes."""

    any_grid = True  # the proposal does not depend on the grid of the run
    tier = Tier.COARSE

    def __call__(self, surface: TriMesh, candidates: tuple[Candidate, ...]) -> list[Candidate]:
        from polycube.structure.rough_map import affine_map
        from polycube.surface.measures import genus

        if genus(surface):
            return []
        low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
        ends = np.array([0.0, 1.0])  # the knots of one cell along each axis
        polycube = Polycube(np.ones((1, 1, 1), bool), ends, ends, ends, (1, 1, 1), ("cube",))
        rough_map = affine_map(polycube, np.diag(high - low), low)
        return [Candidate("bar", polycube, rough_map, cost=0.0, key="bar")]
