"""Refine the hexes to fit the surface more closely."""

import logging
from dataclasses import dataclass, replace
from typing import Annotated

from polycube.hexmesh.generation import sizing
from polycube.hexmesh.settings import Features, features_of
from polycube.registry import register, setting
from polycube.types import HexMesh, TriMesh
from polycube.types.options import Count, Options, limits

logger = logging.getLogger(__name__)


@register("meshing/refine", "split")
@dataclass(frozen=True)
class Split(Options):
    """Split every hex in eight and bring the new boundary onto the surface.

    Where a refinement is not possible, the mesh has a warning and the best mesh is kept.

    Parameters
    ----------
    times : number of refinements, whatever the deviation
    deviation : wanted distance between mesh and surface for 99 % of the points, such as 0.3% or a
        length; the mesh is refined until it is reached; null: no limit
    most : largest number of refinements for the deviation
    features : exact, soft, off or auto; off: no vertex is placed on the curves of the surface
    max_hexes : largest number of hexes; the mesh is not refined if that needs more
    """

    times: Annotated[int, limits(0)] = 0
    deviation: sizing.Length | None = setting("meshing.deviation")
    most: Annotated[int, limits(0)] = 2
    features: Features = setting("meshing.features")
    max_hexes: Count = setting("meshing.max_hexes")

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        """The refined mesh, or the given one if no refinement is requested or none is good."""
        from polycube.fitting.refinement import REACH, refine
        from polycube.surface.measures import diagonal

        unit = diagonal(surface)
        wanted = None if self.deviation is None else sizing.length(self.deviation, unit) / unit
        done = 0
        while why := self._why_more(hexes, surface, wanted, done):
            if 8 * len(hexes.hexes) > self.max_hexes:
                stop = f"{8 * len(hexes.hexes)} hexes are more than max_hexes {self.max_hexes}"
            elif done >= max(self.most, self.times):
                stop = f"{done} refinements are the largest allowed number"
            else:
                features = features_of(self.features, surface)
                uses, is_exact = features != "off", features == "exact"
                finer = refine(hexes, surface, uses, wanted or REACH, is_exact)
                stop = "no mesh of eight times the hexes keeps its quality" * (finer is hexes)
                hexes, done = finer, done + 1
            if stop:
                number = f"the mesh has {len(hexes.hexes)} hexes (try a smaller meshing.size)"
                warning = f"{why}, but {stop}; {number}"
                logger.warning("warning: %s", warning)
                return replace(hexes, warnings=(*hexes.warnings, warning))
        return hexes

    def _why_more(self, hexes: HexMesh, surface: TriMesh, wanted: float | None, done: int) -> str:
        """Reason for another refinement; empty if there is none."""
        from polycube.hexmesh.inspection import inspect

        if wanted is not None:
            reached = inspect(hexes, surface).deviation.p99
            if reached > wanted:
                limit = f"not within the deviation {wanted:.2%}"
                return f"99 % of points are within {reached:.2%} of the diagonal, {limit}"
            logger.info("refine: deviation %.2f %%, limit %.2f %%", 100 * reached, 100 * wanted)
        return f"refinement {done + 1} of {self.times} is requested" if done < self.times else ""
