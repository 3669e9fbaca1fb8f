"""A smaller size where the deviation asked for is not met, if that is cheaper than refinement.

The distance of hexes of length h from a curved surface is like h^2, their number like h^-3: a size
less than twice as fine makes fewer hexes than every hex in eight.
"""

from __future__ import annotations

import logging

from polycube.fitting.refinement import least_jacobian
from polycube.hexmesh import sizing
from polycube.hexmesh.quality import doubts, quality
from polycube.pipeline.portfolio import Portfolio
from polycube.surface.measures import diagonal
from polycube.types import HexMesh, TriMesh

logger = logging.getLogger(__name__)

MOST = 1.9  # times as fine; beyond, refinement makes about as many hexes
SPARE = 1.05  # finer than h^2 says
TRIES = 2


def meet(found: Portfolio, deviation: float | str | None) -> None:
    """Where the result is further off than `deviation`, prefer the first finer one that is not.

    Its variant is run again with a size that should do, and once more with what that one tells.
    The finer mesh must keep the scaled Jacobian that a refined one must keep, and be as free of
    doubts; where there is none the result stays as it is, for `meshing/refine`.
    """
    subdivide = found.chosen_plugin("meshing/subdivide")
    if deviation is None or getattr(subdivide, "level", 0) is not None:
        return
    surface: TriMesh = found.state["surface"]
    coarse: HexMesh = found.end["hexes"]
    wanted = sizing.length(deviation, diagonal(surface)) / diagonal(surface)
    found.preferred = found.chosen
    least = least_jacobian(quality(coarse, surface).scaled_jacobian)
    times, apart = 1.0, _apart(coarse, surface)
    for _ in range(TRIES if apart > wanted else 0):
        times *= SPARE * (apart / wanted) ** 0.5
        if times > MOST:
            logger.info("deviation: %.2f %%, every hex in eight is the cheaper way", 100 * apart)
            return
        logger.info(
            "deviation: %.2f %%, not %.2f %%; a size %.2f times as fine should do",
            100 * apart,
            100 * wanted,
            times,
        )
        name, end = found.rerun({"meshing/subdivide": _finer(subdivide, times, diagonal(surface))})
        if end is None:
            return
        hexes = end["hexes"]
        apart, jacobian = _apart(hexes, surface), quality(hexes, surface).scaled_jacobian
        logger.info(
            "deviation: %.2f %% with %d hexes, scaled Jacobian at least %.3f",
            100 * apart,
            len(hexes.hexes),
            jacobian,
        )
        doubted = doubts(hexes, surface)
        if jacobian < least or len(doubted) > len(doubts(coarse, surface)):
            why = "; ".join(doubted) or f"a finer one must keep {least:.2f}"
            logger.info("deviation: the mesh before is kept, for %s", why)
            return
        if apart <= wanted:
            found.preferred = name
            return
    if apart > wanted:
        logger.info("deviation: not met, the mesh before is kept")


def _finer(subdivide: object, times: float, unit: float) -> dict[str, float]:
    """Options for a size so many times finer, and as many more hexes where the surface curves."""
    options = {"finer": times * subdivide.finer}
    if getattr(subdivide, "curvature", None) is not None:
        options["curvature"] = sizing.length(subdivide.curvature, unit) / times**2
    return options


def _apart(hexes: HexMesh, surface: TriMesh) -> float:
    """Distance in diagonals that 1 % of the points exceed, the worse of both ways."""
    apart = quality(hexes, surface).deviation
    return max(apart.to_surface.p99, apart.to_mesh.p99)
