"""Sheets under the faces where they make hexes better, and under no others.

A sheet under a face with flat corners cures them, but where there is little room it makes hexes
worse, and its neighbours' too.  A mesh with all sheets and one with none show which it is.
"""

from __future__ import annotations

import logging

import numpy as np

from polycube.hexmesh.cad_faces import quad_regions
from polycube.hexmesh.connectivity import quad_sides
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.pipeline.search import Attempt, Variants

logger = logging.getLogger(__name__)

PILLOW = "meshing/pillow"


def keep_good_sheets(found: Variants) -> None:
    """Where sheets are good for some CAD faces and bad for others, try a mesh without the latter.

    Parameters
    ----------
    found : the result of the search
    """
    if not len(found.start.surface.region) or found.reaches >= found.acceptance.acceptable:
        return
    every, none = _best(found, "all"), _best(found, "none")
    if every is None or none is None:
        return
    without, with_all = _worst(none), _worst(every)
    harmed = (with_all < without) & (with_all < found.acceptance.acceptable)
    helped = with_all > without
    if not harmed.any() or not helped.any():
        return
    logger.info("sheets: tried again without those of %d CAD faces", harmed.sum())
    bare = tuple(np.flatnonzero(harmed).tolist())
    found.run_again({PILLOW: {"sheets": "all", "bare": bare}}, in_full=True)


def _best(found: Variants, sheets: str) -> Attempt | None:
    """The best run of the variants with such sheets."""
    runs = [
        attempt
        for (number, _), attempt in found.attempts.items()
        if found.variants[number].get(PILLOW, {}).get("sheets") == sheets
    ]
    return max(runs, key=lambda attempt: attempt.verdict.key, default=None)


def _worst(attempt: Attempt) -> np.ndarray:
    """(F + 1,) least scaled Jacobian of the hexes at each CAD face, by its number."""
    mesh, surface = attempt.state.hexes, attempt.state.surface
    assert mesh is not None  # of a run that succeeded
    worst = np.full(surface.region.max() + 1, np.inf)
    region = quad_regions(mesh, surface)[0]
    quality = scaled_jacobian(mesh.vertices, mesh.hexes)[quad_sides(mesh)[0]]
    np.minimum.at(worst, region, quality)
    return worst
