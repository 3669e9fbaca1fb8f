"""Spline plugins: a spline from a surface and hexes, in one of three spaces, or a chosen one."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import ClassVar

from polycube.analysis.problem import MATERIALS
from polycube.analysis.supports import prescribed, supports
from polycube.errors import MeshingError
from polycube.registry import BY_RUN, register, setting
from polycube.types import HexMesh, Modes, Solution, Spline, TriMesh
from polycube.types.options import Positive

from .options import SplineOptions

logger = logging.getLogger(__name__)

MODES = 10  # lowest modes whose error is estimated, including rigid ones
MOST = 40_000  # functions up to which a matrix is factored as a whole without asking


@dataclass(frozen=True)
class Volumetric(SplineOptions):
    """A spline on the hexes in the space of a subclass."""

    space: ClassVar[str]  # name in `construction.SPACES`

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> Spline:
        """The spline; logs how many edges are sharp and the smallest det J."""
        from .construction import Construction

        made = Construction(self, surface, hexes)
        return made.finished(made.best_trial(self.space))


@register("spline", "c0")
@dataclass(frozen=True)
class C0(Volumetric):
    """The solid of h2s in the space of cubic finite elements, for comparison.

    All Bezier points are free: the functions are tricubic on each hex and continuous between hexes.
    """

    references: ClassVar[tuple[str, ...]] = ("borden2011extraction",)

    space = "c0"


@register("spline", "h2s")
@dataclass(frozen=True)
class H2S(Volumetric):
    """Tricubic spline whose control points are the vertices of the hex mesh.

    It is C2 across regular faces and C0 around extraordinary edges. It approximates the vertices: a
    smooth boundary is inside that of the mesh, and its second normal derivative is 0 there.
    """

    references: ClassVar[tuple[str, ...]] = ("wei2017th", "yu2022hexgen", "borden2011extraction")

    space = "h2s"


@register("spline", "optimal")
@dataclass(frozen=True)
class Optimal(Volumetric):
    """The solid of h2s in a larger space of optimal order, clamped at the boundary.

    The space contains all tricubic polynomials on each hex. It is C2 except across faces at
    extraordinary edges and creases and the adjacent sides of hexes. Dividing the hexes gives a
    space that contains it.
    """

    references: ClassVar[tuple[str, ...]] = ("borden2011extraction",)

    space = "optimal"


@register("spline", "auto")
@dataclass(frozen=True)
class Auto(SplineOptions):
    """h2s where it is accurate enough, else optimal, by an error estimate for the lowest modes.

    The lowest elastic frequencies with the supports of the analysis are computed from h2s, by the
    analysis itself if it estimates their errors. If the error of a squared frequency is larger than
    `error`, as on thin walls with one or two hexes, and for heat conduction, the space is optimal,
    if memory and a limit of 40,000 functions allow it.
    For statics it is h2s: displacement and stress have all continuous tricubic functions anyway. It
    is h2s with cyclic symmetry as well, because the functions of the two cut faces must be equal,
    and for solids of an assembly that are analysed together.

    Parameters
    ----------
    error : largest estimated error, as a share of the squared frequency
    solves : name of the analysis
    """

    references: ClassVar[tuple[str, ...]] = (*H2S.references, *Optimal.references)

    error: Positive = 0.04
    solves: str | None = setting("analysis.plugin", None)
    analysis: Callable[[Spline], Solution] | None = field(default=None, metadata=BY_RUN)

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> Spline | tuple[Spline, Solution]:
        """The spline of the chosen space, and the solution if it was computed on this spline."""
        from .construction import Construction

        made = Construction(self, surface, hexes)
        may_be_larger = self.solves != "static" and self.sector is None and self.joined is None
        larger = may_be_larger and _is_affordable(made.size())
        if larger and self.solves == "poisson":
            return made.finished(made.best_trial(Optimal.space))
        best = made.best_trial(H2S.space)
        spline = made.finished(best)
        error, solution = self._error(spline, hexes) if larger else (0.0, None)
        if error > self.error:
            return made.finished(made.best_trial(Optimal.space, best))
        return spline if solution is None else (spline, solution)

    def _error(self, spline: Spline, hexes: HexMesh) -> tuple[float, Solution | None]:
        """Largest estimated relative error of the squared frequencies, and the solution.

        It is 0 without det J > 0.
        """
        from polycube.analysis.modal import free_modes
        from polycube.hexmesh.named_sets import sets_of_spline

        named = replace(spline, sets=sets_of_spline(spline, hexes))
        held = supports(named, prescribed(self.held))
        try:
            modes = solution = self.analysis(named) if self.analysis else None
            if not isinstance(modes, Modes) or not modes.errors:
                modes = free_modes(named, MATERIALS["steel"], MODES, supports=held, enrich=True)
        except (MeshingError, ValueError):
            return 0.0, None
        error = 2 * max(modes.errors[: MODES - modes.rigid], default=0.0)
        logger.info("h2s: estimated error of a squared frequency %.2g %%", 100 * error)
        return error, solution


def _is_affordable(functions: int) -> bool:
    """Whether a matrix of so many functions may be factored as a whole."""
    from polycube.numerics.memory import available, needed

    if functions > MOST or needed(functions, is_factored=True) > (available() or float("inf")):
        logger.info("h2s: optimal would have %d functions, too many", functions)
        return False
    return True
