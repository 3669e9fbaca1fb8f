"""Options of the reconstruction of point clouds: the settings `points.*` of `conf/infer.yaml`."""

import math
from dataclasses import dataclass

from polycube.errors import InputError

LEAST = {"outliers": 0.0, "neighbours": 3, "depth": 3, "trim": 1.0}
MOST = {"outliers": math.inf, "neighbours": 1000, "depth": 10, "trim": math.inf}
INTEGERS = ("neighbours", "depth")


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
        for name, least in LEAST.items():
            value = getattr(self, name)
            kinds = int if name in INTEGERS else int | float
            fits = isinstance(value, kinds) and not isinstance(value, bool)
            if value is not None and not (fits and least <= value <= MOST[name]):
                kind = "a whole number" if name in INTEGERS else "a number"
                upper = f" to {MOST[name]}" if math.isfinite(MOST[name]) else " or more"
                what = f"must be null or {kind}, {least:g}{upper}; got {value!r}"
                raise InputError(f"points.{name} {what}")
