"""How point clouds are made surfaces: the settings `points.*` of `conf/infer.yaml`."""

from __future__ import annotations

import math
from dataclasses import dataclass

from polycube.errors import InputError

LEAST = {"outliers": 0.0, "neighbours": 3, "depth": 3, "trim": 1.0}
MOST = {"outliers": math.inf, "neighbours": 1000, "depth": 10, "trim": math.inf}
WHOLE = ("neighbours", "depth")


@dataclass(frozen=True)
class Points:
    """How the surface of a point cloud is reconstructed.

    Parameters
    ----------
    outliers : points whose distance to their neighbours is so many standard deviations above the
        mean are removed; None keeps all
    neighbours : number of nearest points that a normal is estimated from; None: 30, or 12 where
        these lie on both sides of a wall
    depth : the grid has 2^depth cells along the longest side; None: cells about as wide as the
        spacing of the points, at most 2^8
    trim : parts of the surface farther from the points than so many spacings are replaced by
        surfaces of least area; None keeps them

    Raises
    ------
    InputError
        For a value out of range.
    """

    outliers: float | None = 3.0
    neighbours: int | None = None
    depth: int | None = None
    trim: float | None = 4.0

    def __post_init__(self) -> None:
        for name, least in LEAST.items():
            value = getattr(self, name)
            kinds = int if name in WHOLE else int | float
            fits = isinstance(value, kinds) and not isinstance(value, bool)
            if value is not None and not (fits and least <= value <= MOST[name]):
                kind = "a whole number" if name in WHOLE else "a number"
                upper = f" to {MOST[name]}" if math.isfinite(MOST[name]) else " or more"
                what = f"must be null or {kind}, {least:g}{upper}; got {value!r}"
                raise InputError(f"points.{name} {what}")
