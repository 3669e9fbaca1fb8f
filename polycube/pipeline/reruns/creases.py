"""Search for a mesh whose edges are near the sharp edges of a surface of triangles.

Chords of long mesh edges cut curves short: more parts of the lattice along them help.  Where
vertices left the curves for the shape of the hexes, a run that never leaves them may be as good.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator

from polycube.fitting.merit import CREASES
from polycube.hexmesh.generation import sizing
from polycube.hexmesh.inspection import Inspection, inspect
from polycube.hexmesh.settings import creases_of
from polycube.kinds import FollowsCreases
from polycube.pipeline.search import Attempt, Options, Variants
from polycube.surface.measures import diagonal
from polycube.types import HexMesh, TriMesh

logger = logging.getLogger(__name__)

LOSS = 0.03  # of the scaled Jacobian that nearer creases are worth
NEARER = 0.8  # share of the distance that is left, at most
FARTHER = 1.1  # times the distance that 99 % of the points may have then
MORE = 2  # times the hexes, at most


def meet_creases(found: Variants, creases: float | str | None) -> None:
    """Where the mesh's edges are further off the sharp edges than asked, prefer a mesh nearer.

    The variant whose mesh is taken is run again with more parts along the sharp edges, and where 5
    % of them are still more than 0.3 % off, with exact features.  A mesh is taken that is nearer by
    a fifth, where its smallest scaled Jacobian is at most 0.03 lower, 99 % of the points are not
    1.1 times as far off, it has no more warnings and at most twice the hexes.

    Parameters
    ----------
    found : the result of the search; its `preferred` run is set
    creases : distance that 95 % of the sharp edges must keep: a length, a share of the diagonal,
        auto or None
    """
    surface = found.start.surface
    asked = creases_of(creases, surface)
    subdivide = found.plugin("meshing/subdivide") if found.attempts else None
    if asked is None or not isinstance(subdivide, FollowsCreases):
        return
    unit = diagonal(surface)
    wanted = sizing.length(asked, unit) / unit
    taken = found.taken()
    if not taken.verdict.is_valid:
        return
    first, found.preferred = taken, found.chosen
    for options in _options(found, subdivide, wanted):
        name, other = found.run_again(options)
        if other is None:
            continue
        logger.info("sharp edges: %s; before: %s", _told(other), _told(taken))
        if _is_better(other, taken, first):
            found.preferred, taken = name, other


def check_creases(creases: float | str | None) -> None:
    """Raise ValueError for what is no value of `meshing.creases`."""
    if creases not in (None, "auto"):
        sizing.check_length("creases", creases)


def creases_missed(mesh: HexMesh, surface: TriMesh, creases: float | str | None) -> Iterator[str]:
    """Say where 5 % of the sharp edges are further off than was asked for; not for auto."""
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
    """Options of one run after the other, as long as the creases are too far off."""
    along = subdivide.crease_options(wanted)
    if along is not None and _seen(found.taken()).creases > wanted:
        yield {"meshing/subdivide": along}
    soft = [stage.kind for stage in found.stages if _is_automatic(stage.plugin)]
    if soft and _seen(found.taken()).creases > max(wanted, CREASES):
        yield {kind: {"features": "exact"} for kind in soft}


def _is_automatic(plugin: object) -> bool:
    """Whether it is left to the program how a stage keeps features."""
    return getattr(plugin, "features", "") == "auto"


def _is_better(other: Attempt, taken: Attempt, first: Attempt) -> bool:
    """Whether a mesh is nearer to the creases than the one taken, and else as good as the first."""
    one, two, start = _seen(other), _seen(taken), _seen(first)
    warnings = len(other.verdict.warnings) <= len(first.verdict.warnings)
    return (
        other.verdict.is_valid
        and warnings
        and one.creases <= NEARER * two.creases
        and one.scaled_jacobian >= start.scaled_jacobian - LOSS
        and _apart(one) <= FARTHER * _apart(start)
        and len(one.mesh.hexes) <= MORE * len(start.mesh.hexes)
    )


def _told(attempt: Attempt) -> str:
    seen = _seen(attempt)
    return (
        f"within {seen.creases:.2%} of the diagonal, least scaled Jacobian "
        f"{seen.scaled_jacobian:.3f}, {len(seen.mesh.hexes)} hexes"
    )


def _seen(attempt: Attempt) -> Inspection:
    assert attempt.state.hexes is not None
    return inspect(attempt.state.hexes, attempt.state.surface)


def _apart(seen: Inspection) -> float:
    """Distance in diagonals that 1 % of the points exceed, the worse of both ways."""
    return max(seen.deviation.to_surface.p99, seen.deviation.to_mesh.p99)
