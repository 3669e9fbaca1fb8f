"""Search for a size that keeps all features, or meets a deviation.

The distance of hexes of length h from a curved surface is of order h^2, their number of order h^-3.
A size reduced by a factor below two needs fewer hexes than dividing every hex into eight. Curves,
points and faces smaller than a hex are resolved by smaller hexes.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping

import numpy as np

from polycube.fitting.merit import least_jacobian
from polycube.hexmesh.feature_distances import TOLERANCE
from polycube.hexmesh.generation import sizing
from polycube.hexmesh.inspection import inspect
from polycube.kinds import Subdivide
from polycube.pipeline.variants import Attempt, Variants
from polycube.surface.measures import diagonal

logger = logging.getLogger(__name__)

FINEST = 1.9  # largest factor; beyond it, refinement needs about as many hexes
MARGIN = 1.05  # additional factor to the prediction by h^2
TRIES = 2
STEP = 1.4  # largest factor in one step, for lost features


def keep_features(found: Variants, least: float = -np.inf) -> None:
    """Try smaller hexes while the mesh loses features of a CAD part; the best mesh is taken.

    Parameters
    ----------
    found : result of the search
    least : scaled Jacobian below which no smaller hexes are tried
    """
    for _ in range(TRIES if found.attempts else 0):
        name, taken = found.chosen, found.taken()
        lost = taken.verdict.lost
        if not lost or _jacobian(taken) < least:
            return
        times = _times(taken)
        options = _options(found, times)
        if options is None:
            return
        logger.info("features: %d are lost; trying hexes that are %.2f times smaller", lost, times)
        found.run_again({"meshing/subdivide": options})
        if found.chosen == name:
            return


def _times(taken: Attempt) -> float:
    """Factor of refinement for the lost features: by h^2, at most STEP."""
    assert taken.state.hexes is not None
    found = inspect(taken.state.hexes, taken.state.surface).features
    farthest = max((each.distance for each in found), default=np.inf)
    return float(np.clip(MARGIN * (farthest / TOLERANCE) ** 0.5, MARGIN, STEP))


def meet_deviation(found: Variants, deviation: float | str | None) -> None:
    """If the distance of the mesh exceeds `deviation`, prefer the first finer mesh that meets it.

    The variant is run again with the predicted size, and once more with a corrected one. The finer
    mesh must have the scaled Jacobian required of a refined mesh, and no more warnings. If there is
    none, the coarse mesh stays, and `meshing/refine` divides it.

    Parameters
    ----------
    found : result of the search; its `preferred` run is set
    deviation : distance within which 99 % of the points must be: a length, or a share of the
        diagonal
    """
    stage = next((s.plugin for s in found.stages if s.kind == "meshing/subdivide"), None)
    if deviation is None or stage is None:
        return
    found.preferred = found.chosen
    unit = diagonal(found.start.surface)
    wanted = sizing.length(deviation, unit) / unit
    coarse = found.taken()
    times, apart = 1.0, _apart(coarse)
    for _ in range(TRIES if apart > wanted else 0):
        times *= MARGIN * (apart / wanted) ** 0.5
        options = _options(found, times)
        if options is None:
            return
        if times > FINEST:
            logger.info("deviation: %.2f %%; refinement is cheaper", 100 * apart)
            return
        logger.info(
            "deviation: %.2f %%, limit %.2f %%; trying hexes that are %.2f times smaller",
            100 * apart,
            100 * wanted,
            times,
        )
        name, finer = found.run_again({"meshing/subdivide": options})
        if finer is None or not _is_accepted(finer, coarse):
            return
        apart = _apart(finer)
        if apart <= wanted:
            found.preferred = name
            return
    if apart > wanted:
        logger.info("deviation: the limit is not met; the previous mesh is the result")


def _options(found: Variants, times: float) -> Mapping[str, object] | None:
    """Options of the subdivision for smaller hexes by a factor; None if not supported."""
    subdivide = found.plugin("meshing/subdivide")
    return subdivide.finer_options(times) if isinstance(subdivide, Subdivide) else None


def _is_accepted(finer: Attempt, coarse: Attempt) -> bool:
    """Whether a finer mesh is otherwise as good as the coarse one; the reason is logged if not."""
    jacobian, before = _jacobian(finer), _jacobian(coarse)
    warnings = [*finer.verdict.failures, *finer.verdict.warnings]
    count = len(coarse.verdict.failures) + len(coarse.verdict.warnings)
    if jacobian >= least_jacobian(before) and len(warnings) <= count:
        return True
    why = (
        "; ".join(warnings)
        or f"the scaled Jacobian of a finer one must be at least {least_jacobian(before):.2f}"
    )
    logger.info("deviation: the previous mesh is the result, because: %s", why)
    return False


def _jacobian(attempt: Attempt) -> float:
    assert attempt.state.hexes is not None
    return inspect(attempt.state.hexes, attempt.state.surface).scaled_jacobian


def _apart(attempt: Attempt) -> float:
    """Distance in diagonals exceeded by 1 % of the points, the larger one of both directions."""
    assert attempt.state.hexes is not None
    found = inspect(attempt.state.hexes, attempt.state.surface).deviation
    return max(found.to_surface.p99, found.to_mesh.p99)
