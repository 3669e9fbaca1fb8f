"""Start states of the ranked structures."""

import logging
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from polycube.state import RunState
from polycube.structure.projection import pull_back
from polycube.structure.recognition import read_structure

logger = logging.getLogger(__name__)

MARGIN = 0.05  # log-likelihood per point by which another polycube must explain points better

Primitives = Mapping[str, np.ndarray]  # (3, 3, 3) voxels by name


def choose(state: RunState, index: int, primitives: Primitives) -> RunState:
    """The state in which the ranked structure `index` is the one that is meshed."""
    entry = state.ranked[index]
    state = replace(
        state,
        chosen=index,
        polycube=entry.candidate.polycube,
        rough_map=entry.candidate.rough_map,
        blocks=entry.candidate.blocks,
        parametrization=pull_back(state.surface, entry.hexes, entry.positions),
        trajectory=None,
        steps=(),
        denoised_on=None,
    )
    for candidate in (each.candidate for each in state.ranked):
        if candidate.key == entry.candidate.key and candidate.trajectory is not None:
            denoised, own = candidate.trajectory, candidate.polycube
            state = replace(state, trajectory=denoised, steps=candidate.steps)
            found = read_structure(denoised[-1], own, primitives, MARGIN)
            if found is own:
                return state
            logger.info("denoised as %s, the points lie on %s", own.context, found.context)
            return replace(state, denoised_on=found)
    return state
