from dataclasses import dataclass
from typing import Any

import numpy as np

from polycube.kinds import Ranking
from polycube.registry import register
from polycube.types import Ranked, TriMesh


@register("ranking", "cheapest")
@dataclass(frozen=True)
class Cheapest(Ranking):
    """Order structures by the distance of their box from that of the part."""

    def __call__(self, surface: TriMesh, candidates: Any) -> list[Ranked]:
        from polycube.hexmesh.generation.blocks import genus_of
        from polycube.hexmesh.generation.template import mesh
        from polycube.structure.rough_map import identity_map
        from polycube.surface.measures import genus

        ranked = []
        for each in candidates:
            if genus_of(each.polycube, each.blocks) == genus(surface):
                x, y, z = (np.full(len(knots) - 1, 2) for knots in each.polycube.knots)
                hexes, at = (
                    mesh(each.polycube, placed, (x, y, z))
                    for placed in (each.rough_map, identity_map(each.polycube))
                )
                ends = [np.array([p.min(0), p.max(0)]) for p in (hexes.vertices, surface.vertices)]
                score = float(np.abs(ends[0] - ends[1]).max())
                ranked.append(Ranked(each, score, {}, hexes, at.vertices))
        return sorted(ranked, key=lambda entry: entry.score)
