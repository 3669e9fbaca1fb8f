"""A place to cure in a fitted mesh, and a tried cure."""

from dataclasses import dataclass

import numpy as np

from polycube.fitting.cures.fitted import Fitted
from polycube.fitting.cures.neighbourhood import Neighbourhood, moving_vertices
from polycube.fitting.cures.refit import Refit

RETRY_GAIN = 0.4  # relative reduction of the cost after which a neighbourhood is fitted again
RELATIVE_GAIN = 0.02  # smallest relative reduction of the cost of an accepted cure
ABSOLUTE_GAIN = 1e-3  # smallest absolute reduction of the cost of an accepted cure
# a cure may reduce the least scaled Jacobian by this factor, or to a sufficient value
LOWER = 0.9
SUFFICIENT = 0.2
NEAR = 0.005  # distance of vertices from the surface, in diagonals, that is always permitted
STRAY = 0.0025  # the same for vertices on exact features, beyond their permitted distance


@dataclass(frozen=True, eq=False)
class Place:
    """A place to cure.

    Parameters
    ----------
    seeds : its poor hexes, the worst first without a sheet
    inside : (H,) hexes to surround by a sheet; None: without a sheet
    face : CAD face over the sheet
    """

    seeds: np.ndarray
    inside: np.ndarray | None = None
    face: int = 0

    def moving(self, fit: Fitted) -> np.ndarray:
        """Vertices that move, ascending."""
        return moving_vertices(fit, self.seeds, self.inside)


@dataclass(frozen=True, eq=False)
class Trial:
    """A tried cure: a neighbourhood, its fit, and the state before."""

    near: Neighbourhood
    found: Refit
    before: float
    least: float
    off: tuple[float, float]  # largest distances before, as in the fit

    @property
    def gain(self) -> float:
        """Reduction of the cost."""
        return self.before - self.found.cost

    @property
    def is_repair(self) -> bool:
        """Whether an invalid hex becomes valid."""
        return self.least <= 0 < self.found.least

    @property
    def is_large(self) -> bool:
        """Whether another trial may be worthwhile."""
        return self.gain > RETRY_GAIN * self.before

    def improves(self, worst: float) -> bool:
        """Whether the cost is lower, and neither a distance nor the worst hex is much worse.

        worst : scaled Jacobian of the worst hex of the whole mesh
        """
        is_lower = self.gain > max(ABSOLUTE_GAIN, RELATIVE_GAIN * self.before)
        is_on = self.found.gap.max() <= max(NEAR, self.off[0]) and self.found.strayed.max() <= max(
            STRAY, self.off[1]
        )
        return (
            is_lower
            and is_on
            and self.found.least >= min(LOWER * self.least, max(SUFFICIENT, worst))
        )
