from dataclasses import dataclass, replace

import numpy as np

from polycube.registry import register
from polycube.types import Labels, Parametrization, Polycube, RoughMap, TriMesh


@register("meshing/map", "stretched")
@dataclass(frozen=True)
class Stretched:
    """Stretch the rough map so that its bounding box is that of the part."""

    def __call__(
        self,
        surface: TriMesh,
        polycube: Polycube,
        labels: Labels,
        parametrization: Parametrization,
        rough_map: RoughMap,
    ) -> RoughMap:
        x = rough_map.positions
        own = x.reshape(-1, 3)
        low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
        share = (x - own.min(axis=0)) / np.ptp(own, axis=0)
        return replace(rough_map, positions=low + share * (high - low))
