from dataclasses import dataclass

import numpy as np

from polycube.registry import register
from polycube.types import HexMesh, Polycube, RoughMap, TriMesh


@register("meshing/subdivide", "even")
@dataclass(frozen=True)
class EvenParts:
    """Cut each interval of the polycube into the same number of parts.

    Parameters
    ----------
    parts : number of parts of each interval
    """

    parts: int = 6

    def finer_options(self, times: float) -> dict[str, object]:
        return {"parts": int(np.ceil(times * self.parts))}

    def __call__(
        self, surface: TriMesh, polycube: Polycube, rough_map: RoughMap, blocks: HexMesh | None
    ) -> HexMesh:
        from polycube.hexmesh.generation.template import mesh

        if blocks is not None:
            return blocks
        x, y, z = (np.full(len(knots) - 1, self.parts) for knots in polycube.knots)
        return mesh(polycube, rough_map, (x, y, z))
