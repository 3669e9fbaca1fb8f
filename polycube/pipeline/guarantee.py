"""The last attempt, if the search ends without a usable mesh.

The hexes of a lattice are valid before they are fitted. They are fitted stage by stage as far as
they stay valid (`polycube.fitting.partial`), so that there is a mesh in the end, with a sentence
about its deviation.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable
from dataclasses import replace
from functools import partial

import numpy as np

from polycube.errors import MeshingError
from polycube.fitting.partial import is_sound, partly_fitted, with_layer
from polycube.hexmesh.generation.blocks import genus_of
from polycube.hexmesh.generation.template import mesh
from polycube.hexmesh.inspection import inspect
from polycube.kinds import KINDS
from polycube.pipeline.choices import is_overlay
from polycube.pipeline.stages import Stage
from polycube.pipeline.state import RunState
from polycube.pipeline.variants import Variants
from polycube.surface import measures
from polycube.surface.fit_target import target
from polycube.types import HexMesh

logger = logging.getLogger(__name__)

# stages that move vertices and do not change the hexes
MOVING = ("meshing/smooth", "meshing/optimize")
NEAR = 0.005  # of the diagonal: boundary vertices farther away from the surface are not fitted


def is_usable(found: Variants) -> bool:
    """Whether the mesh that is taken has no inverted hex and does not cross itself."""
    hexes = found.taken().state.hexes if found.attempts else None
    return hexes is not None and is_sound(hexes)


def in_order(made: Iterable[Variants], best: Variants) -> list[Variants]:
    """Structures for the last attempt: overlays, the finest first, then that of the best mesh.

    Parameters
    ----------
    made : meshed structures, in that order
    best : structure of the best mesh
    """
    overlays = sorted(filter(_is_lattice, [*made][::-1]), key=_number_of_cells, reverse=True)
    return [*overlays, *[best] * (best not in overlays)]


def last_attempt(starts: Iterable[Variants], why: str) -> RunState | None:
    """The first structure with valid unfitted hexes, fitted as far as they stay valid.

    Parameters
    ----------
    starts : structures, the best first
    why : reason why no fitted mesh is valid

    Returns
    -------
    The state, or None if no structure has valid hexes. `unfitted` of the state describes the
    deviation, unless all boundary vertices are on the surface and the acceptance finds the mesh
    valid.
    """
    for start in starts:
        hexes = _unfitted(start)
        if hexes is None or not is_sound(hexes):
            continue
        logger.info("last attempt: %d hexes, fitted as far as they stay valid", len(hexes.hexes))
        made = [_described(start, with_layer(hexes, target(start.start.surface)), why)]
        start.deadline.note(made[0])
        for stage in start.stages:
            if stage.kind in MOVING:
                made.append(_described(start, _moved(start, stage, made[-1]), why))
                start.deadline.note(made[-1])
        return max(made, key=lambda state: _key(start, state))
    return None


def wrong_topology(state: RunState) -> str:
    """A sentence if mesh and part differ in genus, with the distance; else empty."""
    if state.polycube is None:
        return ""
    has, wanted = genus_of(state.polycube, state.blocks), measures.genus(state.surface)
    if has == wanted:
        return ""
    return (
        f"the topology differs: the mesh has genus {has}, the part {wanted}, and no lattice with "
        f"the genus of the part was found; {_distances(state)}"
    )


def _is_lattice(start: Variants) -> bool:
    state = start.start
    return bool(state.ranked) and is_overlay(state.ranked[state.chosen])


def _number_of_cells(start: Variants) -> int:
    polycube = start.start.polycube
    return 0 if polycube is None else int(polycube.occupancy.sum())


def _unfitted(start: Variants) -> HexMesh | None:
    """Cells of an overlay; for another structure, the result of the first stages."""
    state = start.start
    if _is_lattice(start):
        assert state.polycube is not None and state.rough_map is not None
        x, y, z = (np.ones(n, np.int64) for n in state.polycube.occupancy.shape)
        return mesh(state.polycube, state.rough_map, (x, y, z))
    for stage in start.stages:
        try:
            state = stage.put(state, start.clock.run(stage.kind, partial(stage, state)))
        except MeshingError as error:
            logger.info("last attempt: %s", error)
            return None
        if not KINDS[stage.kind].fits:
            return state.hexes
    return None


def _moved(start: Variants, stage: Stage, state: RunState) -> HexMesh:
    """Result of a stage for valid hexes, as far as they stay valid."""
    hexes = state.hexes
    assert hexes is not None
    try:
        fitted = start.clock.run(stage.kind, partial(stage, state))
    except MeshingError as error:
        logger.info("last attempt: %s", error)
        return hexes
    assert isinstance(fitted, HexMesh)
    if not np.array_equal(fitted.hexes, hexes.hexes) or not np.isfinite(fitted.vertices).all():
        return hexes
    valid, share = partly_fitted(hexes, fitted.vertices)
    logger.info(
        "%s: %d of %d vertices are moved only in part", stage.kind, (share < 1).sum(), len(share)
    )
    return valid


def _described(start: Variants, hexes: HexMesh, why: str) -> RunState:
    """The state with these hexes, and a description of their deviation if there is one."""
    state = replace(start.start, hexes=hexes)
    off = _off_surface(state)
    if not off and start.acceptance(hexes, state.surface).is_valid:
        return state
    sentence = (
        f"no fitted mesh is valid ({why}); this one is only partly fitted: {off:.1%} of its "
        f"boundary vertices are more than {NEAR:.1%} of the diagonal away from the surface; "
        f"{_distances(state)}"
    )
    return replace(state, unfitted=sentence)


def _key(start: Variants, state: RunState) -> tuple[float, ...]:
    assert state.hexes is not None
    return start.acceptance(state.hexes, state.surface).key


def _off_surface(state: RunState) -> float:
    """Share of the boundary vertices that are not on the surface."""
    assert state.hexes is not None
    goal, outer = target(state.surface), np.unique(state.hexes.quads)
    places = goal.to_unit(state.hexes.vertices[outer])
    return float((np.linalg.norm(places - goal.closest(places)[0], axis=1) > NEAR).mean())


def _distances(state: RunState) -> str:
    """The largest distance and that of 99 % of the points, in diagonals, and the place."""
    assert state.hexes is not None
    found = inspect(state.hexes, state.surface)
    p99 = max(found.deviation.to_surface.p99, found.deviation.to_mesh.p99)
    return (
        f"the largest distance is {found.largest:.2%} of the diagonal at "
        f"{np.round(found.farthest_at, 3).tolist()}, that of 99 % of the points {p99:.2%}"
    )
