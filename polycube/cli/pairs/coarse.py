"""Mesh a part on a coarse polycube: the meshing stages of a run, with few slabs per axis."""

import json
from dataclasses import replace
from threading import Event

from polycube.config import compose
from polycube.diffusion.pairs.lattices import MOST_SLABS
from polycube.errors import InputError, MeshingError
from polycube.pipeline.intake import read_part
from polycube.pipeline.run import Run
from polycube.pipeline.settings import Settings
from polycube.search.structures import choose
from polycube.state import RunState
from polycube.structure.lattice import collapse
from polycube.types import Json, Ranked

COARSE = ("structure=coarse", "order=[meshing]")
NAMES = {"size": "meshing.size"} | {n: n for n in ("effort", "seconds", "repair", "seed")}


def mesh_coarsely(path: str, cfg: Json, interrupt: Event | None = None) -> RunState:
    """The last state of a run that ended with a valid mesh.

    path : path of the part
    cfg : size, effort, seconds, repair and seed, as in a run

    Raises
    ------
    InputError
        If the part is invalid, or if it has no structure with few slabs.
    MeshingError
        If no mesh is valid.
    KeyboardInterrupt
        If the user ended the run.
    """
    settings = replace(_settings(cfg), mesh=path)
    run = Run(settings, read_part, interrupt)
    state = run.begin()
    ranked = [entry for entry in state.ranked if _is_coarse(entry)]
    if not ranked:
        raise InputError(
            f"all structures found have more than {MOST_SLABS} slabs along an axis, which is more "
            "than the network can describe"
        )
    state = run.mesh(choose(replace(state, ranked=ranked), 0, run.primitives))
    if state.interrupted:
        raise KeyboardInterrupt
    if state.failure is not None:
        raise MeshingError(state.failure)
    return state


def check(cfg: Json) -> None:
    """Raise InputError for an invalid setting."""
    Run(_settings(cfg), read_part)


def _settings(cfg: Json) -> Settings:
    options = [f"{NAMES[name]}={json.dumps(cfg[name])}" for name in NAMES]
    return Settings.of(compose("infer", [*COARSE, *options]))


def _is_coarse(entry: Ranked) -> bool:
    return max(collapse(entry.candidate.polycube).occupancy.shape) <= MOST_SLABS
