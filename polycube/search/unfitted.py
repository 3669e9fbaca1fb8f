"""The last resort of a search: the hexes of a lattice, fitted as far as they stay valid.

The hexes of a lattice are valid before they are fitted. They are fitted stage by stage
(`polycube.fitting.uncrossing`), so that there is a mesh in the end, with a sentence about its
deviation. Such a mesh is not a valid result.
"""

import logging
from dataclasses import replace
from functools import partial

import numpy as np

from polycube.errors import MeshingError
from polycube.fitting.uncrossing import is_sound, partly_fitted, with_layer
from polycube.hexmesh.generation.blocks import genus_of
from polycube.hexmesh.generation.template import mesh as cells
from polycube.hexmesh.inspection import inspect
from polycube.kinds import KINDS
from polycube.search.history import Task, judged
from polycube.stages import Stage
from polycube.state import RunState
from polycube.surface import measures
from polycube.surface.fit_target import target
from polycube.types import HexMesh, Tier

logger = logging.getLogger(__name__)

# stages that move vertices and do not change the hexes
MOVING = ("meshing/smooth", "meshing/optimize")
NEAR = 0.005  # of the diagonal: boundary vertices farther away from the surface are not fitted


def partly_fitted_state(task: Task, start: RunState, why: str) -> RunState | None:
    """The state of a structure with its hexes, fitted as far as they stay valid.

    Returns the state, or None if the hexes are not valid before they are fitted. `unfitted` of the
    state describes the deviation, unless all boundary vertices are on the surface and the
    acceptance finds the mesh valid.

    start : state from which the structure is meshed
    why : reason why no fitted mesh is valid
    """
    hexes = _unfitted(task, start)
    if hexes is None or not is_sound(hexes):
        return None
    logger.info("last resort: %d hexes, fitted as far as they stay valid", len(hexes.hexes))
    made = [with_layer(hexes, target(start.surface))]
    for stage in task.fit:
        if stage.kind in MOVING:
            made.append(_moved(task, stage, replace(start, hexes=made[-1])))
    verdicts = [(judged(task.acceptance, mesh, start.surface), mesh) for mesh in made]
    verdict, mesh = max(verdicts, key=lambda each: each[0].key)
    best, goal = replace(start, hexes=mesh), target(start.surface)
    outer = goal.to_unit(mesh.vertices[np.unique(mesh.quads)])
    # share of the boundary vertices that are not on the surface
    off = float((np.linalg.norm(outer - goal.closest(outer)[0], axis=1) > NEAR).mean())
    if not off and verdict.is_valid:
        return best
    sentence = (
        f"no fitted mesh is valid ({why}); this one is only partly fitted: {off:.1%} of its "
        f"boundary vertices are more than {NEAR:.1%} of the diagonal away from the surface; "
        f"{_distances(best)}"
    )
    return replace(best, unfitted=sentence)


def wrong_topology(state: RunState) -> str:
    """A sentence if mesh and part differ in genus, with the distance; else empty."""
    if state.polycube is None:
        return ""
    has, wanted = genus_of(state.polycube, state.blocks), measures.genus(state.surface)
    if has == wanted:
        return ""
    differs = f"the topology differs: the mesh has genus {has}, the part {wanted}"
    none = "no lattice with the genus of the part was found"
    return f"{differs}, and {none}; {_distances(state)}"


def _unfitted(task: Task, state: RunState) -> HexMesh | None:
    """Cells of a fine lattice; for another structure, the result of the first stages."""
    if state.ranked and state.ranked[state.chosen].candidate.tier >= Tier.FINE:
        assert state.polycube is not None and state.rough_map is not None
        x, y, z = (np.ones(n, np.int64) for n in state.polycube.occupancy.shape)
        return cells(state.polycube, state.rough_map, (x, y, z))
    for stage in task.fit:
        try:
            state = stage.put(state, task.chain.clock.run(stage.kind, partial(stage, state)))
        except MeshingError as error:
            logger.info("last resort: %s", error)
            return None
        if not KINDS[stage.kind].fits:
            return state.hexes
    return None


def _moved(task: Task, stage: Stage, state: RunState) -> HexMesh:
    """Result of a stage for valid hexes, as far as they stay valid."""
    hexes = state.hexes
    assert hexes is not None
    try:
        fitted = task.chain.clock.run(stage.kind, partial(stage, state))
    except MeshingError as error:
        logger.info("last resort: %s", error)
        return hexes
    assert isinstance(fitted, HexMesh)
    if not np.array_equal(fitted.hexes, hexes.hexes) or not np.isfinite(fitted.vertices).all():
        return hexes
    valid, share = partly_fitted(hexes, fitted.vertices)
    message = "%s: %d of %d vertices are moved only in part"
    logger.info(message, stage.kind, (share < 1).sum(), len(share))
    return valid


def _distances(state: RunState) -> str:
    """The largest distance and that of 99 % of the points, in diagonals, and the place."""
    assert state.hexes is not None
    found = inspect(state.hexes, state.surface)
    place = np.round(found.farthest_at, 3).tolist()
    largest = f"the largest distance is {found.largest:.2%} of the diagonal at {place}"
    return f"{largest}, that of 99 % of the points {found.deviation.p99:.2%}"
