"""The spline space that an error estimate requires."""

from __future__ import annotations

import logging
from dataclasses import dataclass, fields, replace
from typing import ClassVar

from polycube.analysis.problem import MATERIALS
from polycube.analysis.supports import prescribed, supports
from polycube.errors import MeshingError
from polycube.registry import register
from polycube.types import HexMesh, Spline, TriMesh

from .options import SplineOptions
from .volumetric import H2S, Optimal

logger = logging.getLogger(__name__)

MODES = 10  # lowest modes whose error is estimated, including rigid ones
LEAST = 1.6  # functions of optimal per function of h2s, at least
MOST = 40_000  # functions up to which a matrix is factored as a whole without asking


@register("spline", "auto")
@dataclass(frozen=True)
class Auto(SplineOptions):
    """h2s where it is accurate enough, else optimal, by an error estimate for the lowest modes.

    The lowest elastic modes with the supports of the analysis are computed with h2s. If the error
    of a squared frequency, which is about that of a displacement, is larger than `error`, the space
    is optimal. That is so on thin walls with one or two hexes, and with few hexes along a bending
    part. If memory, or a limit of 40,000 functions, does not allow optimal, h2s is kept, and the
    analysis warns.

    Parameters
    ----------
    error : largest estimated error, as a share of the squared frequency
    """

    references: ClassVar[tuple[str, ...]] = (*H2S.references, *Optimal.references)

    error: float = 0.02

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.error > 0:
            raise ValueError(f"error must be positive; got {self.error}")

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> Spline:
        """The spline of the chosen space; logs the estimate."""
        options = {f.name: getattr(self, f.name) for f in fields(SplineOptions)}
        spline = H2S(**options)(surface, hexes)
        if not _is_affordable(LEAST * len(spline.control)):
            logger.info("h2s: too many functions for optimal")
            return spline
        error = self._error(spline, hexes)
        logger.info("h2s: estimated error of the displacement %.2g %%", 100 * error)
        if error <= self.error:
            return spline
        larger = Optimal(**options)(surface, hexes)
        return larger if _is_affordable(len(larger.control)) else spline

    def _error(self, spline: Spline, hexes: HexMesh) -> float:
        """Largest estimated relative error of the squared frequencies; 0 without det J > 0."""
        from polycube.analysis.modal import free_modes
        from polycube.hexmesh.named_sets import sets_of_spline

        named = replace(spline, sets=sets_of_spline(spline, hexes))
        held = supports(named, prescribed(self.held))
        try:
            modes = free_modes(named, MATERIALS["steel"], MODES, supports=held)
        except (MeshingError, ValueError):
            return 0.0
        return 2 * max(modes.errors, default=0.0)


def _is_affordable(functions: float) -> bool:
    """Whether a matrix of so many functions may be factored as a whole."""
    from polycube.numerics.memory import available, needed

    free = available()
    wanted = needed(int(functions), is_factored=True)
    return functions <= MOST and (free is None or wanted <= free)
