"""The map from the polycube to the surface, chart by chart."""

import logging
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from polycube.registry import register
from polycube.types import Labels, Parametrization, Polycube, RoughMap, TriMesh
from polycube.types.options import Options, Positive, limits

logger = logging.getLogger(__name__)


@register("meshing/map", "harmonic")
@dataclass(frozen=True)
class Harmonic(Options):
    """Flatten patches of the surface onto polycube faces, with a harmonic map inside.

    The weights are cotangents. If triangles flip, mean-value weights are used, and patches are cut
    into rectangles.

    Parameters
    ----------
    level : number of parts of each lattice interval in the map, as a power of two
    longest : longest edge of the surface before it is cut, as a share of the diagonal
    """

    references: ClassVar[tuple[str, ...]] = ("floater1997parametrization", "floater2003mean")

    level: Annotated[int, limits(0)] = 3
    longest: Positive = 0.02

    def __call__(
        self,
        surface: TriMesh,
        polycube: Polycube,
        labels: Labels,
        parametrization: Parametrization,
        rough_map: RoughMap,
    ) -> RoughMap:
        """Map on a lattice with 2^level parts of each interval, with its boundary on the surface.

        Raises MeshingError with the patch that has a wrong topology or folds.
        """
        from polycube.charts.charts import flatten
        from polycube.charts.harmonic import chart_map
        from polycube.charts.segmentation import segment

        pieces = segment(surface, polycube, labels, parametrization, self.longest)
        sheet = flatten(pieces)
        logger.info("map: %d charts, no triangle flipped", pieces.outside.patch.max() + 1)
        x, y, z = (np.full(n, 2**self.level) for n in polycube.occupancy.shape)
        return chart_map(polycube, pieces.outside, sheet, rough_map, (x, y, z))
