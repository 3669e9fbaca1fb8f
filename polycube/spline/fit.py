"""Options of the fit of a spline to a surface."""

from dataclasses import dataclass

from polycube.types.checks import check_number, is_number


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
        check_number("fit.iterations", self.iterations, 0, whole=True)
        check_number("fit.rounds", self.rounds, 0, whole=True)
        if not is_number(self.floor):
            raise ValueError(f"fit.floor must be a number; got {self.floor!r}")
        if not 0 < self.floor < 1:
            raise ValueError(f"fit.floor must lie in (0, 1); got {self.floor}")
