"""The section of a part, without details that would make its quads poor."""

import numpy as np

from polycube.hexmesh.background.arrangement import arrangement
from polycube.hexmesh.background.background import Background, NoBackgroundError
from polycube.hexmesh.background.cells import cells
from polycube.hexmesh.background.curves import Sizes, curves, curves_round
from polycube.hexmesh.background.section import Section, section
from polycube.hexmesh.background.smoothing import sines
from polycube.hexmesh.generation.quads import NoQuadsError
from polycube.surface.measures import diagonal
from polycube.types import TriMesh

# of the diagonal: sizes below which details are merged, one after the other
DETAILS = 1e-5, 5e-4, 1e-3
SUFFICIENT = 0.1  # smallest sine of an angle of the quads above which no more details are merged
BETTER = 0.08  # by how much it must be larger for each of these sizes
ENDS = 1e-4  # of the diagonal: smallest tolerance for the ends of curves


def section_of(
    surface: TriMesh, part: Background, sizes: Sizes
) -> tuple[Section, Background, np.ndarray]:
    """The quads of the section of a part, its levels, and the full cells in each slab (C, K).

    If quads with details such as the run-out of a fillet at a tangent are poor, or if there are
    none, the details are merged.

    Raises
    ------
    NoBackgroundError, NoQuadsError
        If there are none without details, either; with the reason for all of them.
    """
    found: list[tuple[float, Section, Background, np.ndarray]] = []
    reasons: list[Exception] = []
    for share in DETAILS:
        near = share * diagonal(surface)
        cut = part.with_distinct_levels(near)
        try:
            points, edges = arrangement(cut.points, cut.lines, near)
            filled = cells(surface, cut, points, edges)
            chains = curves(points, edges, cut.marks, max(near, ENDS * diagonal(surface)))
            flat = section(chains, curves_round(chains, filled), filled.full, sizes)
        except (NoBackgroundError, NoQuadsError) as reason:
            reasons.append(reason)
            continue
        least = float(sines(flat.vertices, flat.quads).min())
        found.append((least - BETTER * len(found), flat, cut, filled.full))
        if least > SUFFICIENT:
            break
    if not found:
        raise reasons[0]
    return max(found, key=lambda each: each[0])[1:]
