"""Options of the fit of a spline to a surface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Fit:
    """Options of the fit of a spline to the surface.

    Parameters
    ----------
    iterations : largest number of least-squares steps; 0: no fit
    floor : scaled det J that elements should have; elements below it are raised
    rounds : largest number of rounds that raise elements below the floor
    """

    iterations: int = 6
    floor: float = 0.1
    rounds: int = 3

    def __post_init__(self) -> None:
        for name in ("iterations", "rounds"):
            value = getattr(self, name)
            if not isinstance(value, int) or isinstance(value, bool) or value < 0:
                raise ValueError(f"fit.{name} must be a whole number >= 0; got {value!r}")
        if isinstance(self.floor, bool) or not isinstance(self.floor, int | float):
            raise ValueError(f"fit.floor must be a number; got {self.floor!r}")
        if not 0 < self.floor < 1:
            raise ValueError(f"fit.floor must lie in (0, 1); got {self.floor}")

    @classmethod
    def of(cls, options: Mapping | Fit) -> Fit:
        """The options by name; raises ValueError for unknown ones."""
        if isinstance(options, Fit):
            return options
        unknown = sorted(set(options) - set(cls.__dataclass_fields__))
        if unknown:
            raise ValueError(f"fit takes {', '.join(cls.__dataclass_fields__)}; got {unknown[0]!r}")
        return cls(**options)
