"""Options of the reconstruction of point clouds: the settings `points.*` of `conf/infer.yaml`."""

from dataclasses import dataclass
from math import inf

from polycube.types.checks import check_number

# of each option: the least and the largest number, and whether it is a whole one
LIMITS = {
    "outliers": (0, inf, False),
    "neighbours": (3, 1000, True),
    "depth": (3, 10, True),
    "trim": (1, inf, False),
}


@dataclass(frozen=True)
class Points:
    """Options of the reconstruction of a surface from points.

    Parameters
    ----------
    outliers
        Points are removed if the distance to their neighbours exceeds the mean by this number of
        standard deviations. None: all points are kept.
    neighbours
        Number of nearest points from which a normal is estimated. None: 30, or 12 or 60 if the
        normals are inconsistent with 30.
    depth
        The grid has 2^depth cells along the longest side. None: the cells are about as wide as the
        spacing of the points; the depth is at most 8.
    trim
        Parts of the surface whose distance from the points exceeds this number of spacings are
        replaced by surfaces of least area. None: they are kept.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    outliers: float | None = 3.0
    neighbours: int | None = None
    depth: int | None = None
    trim: float | None = 4.0

    def __post_init__(self) -> None:
        for name, limits in LIMITS.items():
            if getattr(self, name) is not None:
                check_number(f"points.{name}", getattr(self, name), *limits, other="null")
