"""Options of the fit of a spline to a surface."""

from dataclasses import dataclass
from typing import Annotated

from polycube.types.options import Options, limits


@dataclass(frozen=True)
class Fit(Options):
    """Options of the fit of a spline to the surface.

    Parameters
    ----------
    iterations : largest number of least-squares steps; 0: no fit
    floor : scaled det J that elements should have; elements below it are raised
    rounds : largest number of rounds that raise elements below the floor
    """

    group = "fit."
    iterations: Annotated[int, limits(0)] = 6
    floor: Annotated[float, limits(0, 1, is_open=True)] = 0.1
    rounds: Annotated[int, limits(0)] = 5
