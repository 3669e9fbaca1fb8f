"""The preload of a section, such as that of a bolt."""

from dataclasses import dataclass

import numpy as np

from polycube.analysis.loads import Vector
from polycube.surface.measures import unit
from polycube.types.checks import is_number


@dataclass(frozen=True)
class Preload:
    """A force with which the two sides of a section of the part are pulled together."""

    point: Vector = ()  # in the unit of the part; the section is the connected one around it
    axis: Vector = ()
    force: float = 0.0  # N

    def __post_init__(self) -> None:
        numbers = (*self.point, *self.axis, self.force)
        if len(numbers) != 7 or not all(map(is_number, numbers)) or not any(self.axis):
            raise ValueError(
                "each of preloads has a point [x, y, z], an axis [x, y, z] that is not zero, and a "
                "force in N"
            )

    @property
    def direction(self) -> np.ndarray:
        """(3,) the axis with length 1, without rounding errors that look like components."""
        return unit(np.array(self.axis, float)).round(12)

    def __str__(self) -> str:
        return f"the preload at {list(self.point)}"
