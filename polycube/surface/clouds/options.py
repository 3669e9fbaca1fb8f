"""Options of the reconstruction of point clouds: the settings `points.*` of `conf/infer.yaml`."""

from dataclasses import dataclass
from typing import Annotated

from polycube.types.options import Options, limits


@dataclass(frozen=True)
class Points(Options):
    """Options of the reconstruction of a surface from points.

    outliers : points are removed if the distance to their neighbours exceeds the mean by this
        number of standard deviations; None: all points are kept
    neighbours : number of nearest points from which a normal is estimated; None: 30, or 12 or 60 if
        the normals are inconsistent with 30
    depth : the grid has 2^depth cells along the longest side; None: the cells are about as wide as
        the spacing of the points, and the depth is at most 8
    trim : parts of the surface whose distance from the points exceeds this number of spacings are
        replaced by surfaces of least area; None: they are kept
    """

    group = "points."
    outliers: Annotated[float, limits(0)] | None = 3.0
    neighbours: Annotated[int, limits(3, 1000)] | None = None
    depth: Annotated[int, limits(3, 10)] | None = None
    trim: Annotated[float, limits(1)] | None = 4.0
