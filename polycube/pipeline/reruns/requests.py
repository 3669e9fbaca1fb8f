"""Search for the numbers of parts that give the requested numbers of hexes.

Layers under the boundary are added after the lattice is divided, and count as hexes through a wall.
Their number is determined from the mesh, and the lattice is divided again with fewer parts.
"""

from __future__ import annotations

import logging

import numpy as np

from polycube.hexmesh.generation.requests import requests_of
from polycube.hexmesh.generation.requests_met import reached
from polycube.kinds import CountsHexes
from polycube.pipeline.variants import Attempt, Variants

logger = logging.getLogger(__name__)

TRIES = 3


def meet_requests(found: Variants) -> None:
    """If the mesh does not have the hexes requested by `meshing.at`, prefer one that has them.

    The variant of the best mesh is run again with as many additional or fewer parts as hexes are
    missing or superfluous. A mesh is accepted if it is closer to the numbers, is valid, loses no
    more features and has no more warnings.

    Parameters
    ----------
    found : result of the search; its `preferred` run is set
    """
    subdivide = found.plugin("meshing/subdivide") if found.attempts else None
    if not isinstance(subdivide, CountsHexes) or not subdivide.at:
        return
    taken = found.taken()
    if not taken.verdict.is_valid:
        return
    missing = _missing(subdivide, taken)
    for _ in range(TRIES if missing.any() else 0):
        options = subdivide.count_options(missing.tolist())
        if options is None:
            return
        logger.info("meshing.at: differences %s; trying other numbers of parts", missing.tolist())
        name, other = found.run_again({"meshing/subdivide": options})
        if other is None or not _is_as_good(other, taken):
            return
        left = _missing(subdivide, other)
        if np.abs(left).sum() >= np.abs(missing).sum():
            return
        found.preferred, taken, missing = name, other, left
        if not missing.any():
            return
        subdivide = found.plugin("meshing/subdivide")
        assert isinstance(subdivide, CountsHexes)


def _missing(subdivide: CountsHexes, attempt: Attempt) -> np.ndarray:
    """(N,) number of missing hexes of each entry, negative for superfluous ones.

    More edges around a rim than requested are permitted: a lattice cannot have every number.
    """
    surface, hexes = attempt.state.surface, attempt.state.hexes
    assert hexes is not None
    requests = requests_of(subdivide.at)
    found = np.zeros(len(requests), np.int64)
    for number, has in enumerate(reached(hexes, surface, requests)):
        request = requests[number]
        off = 0.0 if has is None else request.wanted(surface) - has
        if request.kind == "through" or (request.kind == "around" and off > 0):
            found[number] = round(off)
    return found


def _is_as_good(other: Attempt, taken: Attempt) -> bool:
    """Whether a mesh is valid, loses no more features and has no more warnings."""
    one, two = other.verdict, taken.verdict
    return one.is_valid and one.lost <= two.lost and len(one.warnings) <= len(two.warnings)
