"""Search for a mesh whose edges are closer to the sharp edges of a triangle surface.

Long mesh edges are chords of curved edges: more parts of the lattice along them help. If vertices
left the curves to improve the hexes, a run with exact features may be as good.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator

from polycube.fitting.merit import CREASES
from polycube.hexmesh.generation import sizing
from polycube.hexmesh.inspection import Inspection, inspect
from polycube.hexmesh.settings import creases_of
from polycube.kinds import FollowsCreases
from polycube.pipeline.variants import Attempt, Options, Variants
from polycube.surface.measures import diagonal
from polycube.types import HexMesh, TriMesh

logger = logging.getLogger(__name__)

LOSS = 0.03  # loss of scaled Jacobian permitted for closer creases
NEARER = 0.8  # largest share of the distance that remains
FARTHER = 1.1  # largest factor on the distance of 99 % of the points
MORE = 2  # largest factor on the number of hexes


def meet_creases(found: Variants, creases: float | str | None) -> None:
    """If the edges of the mesh are too far from the sharp edges, prefer a closer mesh.

    The variant of the best mesh is run again with more parts along the sharp edges, and if 5 % of
    them are still farther than 0.3 %, with exact features. A mesh is accepted if it is closer by a
    fifth, its smallest scaled Jacobian is at most 0.03 lower, the distance of 99 % of the points
    grows by less than a factor of 1.1, and it has no more warnings and at most twice the hexes.

    Parameters
    ----------
    found : result of the search; its `preferred` run is set
    creases : distance within which 95 % of the sharp edges must be: a length, a share of the
        diagonal, auto or None
    """
    surface = found.start.surface
    requested = creases_of(creases, surface)
    subdivide = found.plugin("meshing/subdivide") if found.attempts else None
    if requested is None or not isinstance(subdivide, FollowsCreases):
        return
    unit = diagonal(surface)
    wanted = sizing.length(requested, unit) / unit
    taken = found.taken()
    if not taken.verdict.is_valid:
        return
    first, found.preferred = taken, found.chosen
    for options in _options(found, subdivide, wanted):
        name, other = found.run_again(options)
        if other is None:
            continue
        logger.info("sharp edges: %s; before: %s", _description(other), _description(taken))
        if _is_better(other, taken, first):
            found.preferred, taken = name, other


def check_creases(creases: float | str | None) -> None:
    """Raise ValueError for an invalid value of `meshing.creases`."""
    if creases not in (None, "auto"):
        sizing.check_length("creases", creases)


def creases_missed(mesh: HexMesh, surface: TriMesh, creases: float | str | None) -> Iterator[str]:
    """A sentence if 5 % of the sharp edges are farther than requested; not for auto."""
    if creases in (None, "auto"):
        return
    unit = diagonal(surface)
    wanted, reached = sizing.length(creases, unit) / unit, inspect(mesh, surface).creases
    if reached > wanted:
        yield (
            f"meshing.creases: 95 % of the sharp edges are within {reached:.2%} of the diagonal of "
            f"the mesh's edges, not within {wanted:.2%}"
        )


def _options(found: Variants, subdivide: FollowsCreases, wanted: float) -> Iterator[Options]:
    """Options of further runs, while the creases are too far away."""
    along = subdivide.crease_options(wanted)
    if along is not None and _inspected(found.taken()).creases > wanted:
        yield {"meshing/subdivide": along}
    soft = [stage.kind for stage in found.stages if _is_automatic(stage.plugin)]
    if soft and _inspected(found.taken()).creases > max(wanted, CREASES):
        yield {kind: {"features": "exact"} for kind in soft}


def _is_automatic(plugin: object) -> bool:
    """Whether the treatment of features in a stage is chosen automatically."""
    return getattr(plugin, "features", "") == "auto"


def _is_better(other: Attempt, taken: Attempt, first: Attempt) -> bool:
    """Whether a mesh is closer to the creases than `taken`, and otherwise as good as `first`."""
    one, two, start = _inspected(other), _inspected(taken), _inspected(first)
    warnings = len(other.verdict.warnings) <= len(first.verdict.warnings)
    return (
        other.verdict.is_valid
        and warnings
        and one.creases <= NEARER * two.creases
        and one.scaled_jacobian >= start.scaled_jacobian - LOSS
        and _apart(one) <= FARTHER * _apart(start)
        and len(one.mesh.hexes) <= MORE * len(start.mesh.hexes)
    )


def _description(attempt: Attempt) -> str:
    seen = _inspected(attempt)
    return (
        f"within {seen.creases:.2%} of the diagonal, least scaled Jacobian "
        f"{seen.scaled_jacobian:.3f}, {len(seen.mesh.hexes)} hexes"
    )


def _inspected(attempt: Attempt) -> Inspection:
    assert attempt.state.hexes is not None
    return inspect(attempt.state.hexes, attempt.state.surface)


def _apart(seen: Inspection) -> float:
    """Distance in diagonals exceeded by 1 % of the points, the larger one of both directions."""
    return max(seen.deviation.to_surface.p99, seen.deviation.to_mesh.p99)
