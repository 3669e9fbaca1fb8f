"""Search for the numbers of parts that give the numbers of hexes asked for.

Layers under the boundary are made after the lattice is cut, and count as hexes through a wall.  How
many there are is seen on the mesh; the lattice is cut again with so many parts fewer.
"""

from __future__ import annotations

import logging

import numpy as np

from polycube.hexmesh.generation.requests import requests_of
from polycube.hexmesh.generation.requests_met import reached
from polycube.kinds import CountsHexes
from polycube.pipeline.search import Attempt, Variants

logger = logging.getLogger(__name__)

TRIES = 3


def meet_requests(found: Variants) -> None:
    """Where the mesh has not the hexes that `meshing.at` asks for, prefer one that has.

    The variant whose mesh is taken is run again with as many parts more or fewer as there are hexes
    too few or too many.  A mesh is taken that comes nearer to the numbers, where it is valid,
    loses no more features and has no more warnings.

    Parameters
    ----------
    found : the result of the search; its `preferred` run is set
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
    """(N,) hexes that the mesh has too few at each entry, or too many where negative.

    More edges round a rim than asked for are none too many: a lattice has not every number.
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
