"""The pictures of a run: scenes made from its state, drawn in other processes.

A failed picture must not end a run: it is omitted, with one warning.
"""

import logging
import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

from polycube.analysis.problem import Problem
from polycube.report.numbers.quality import quad_deviation
from polycube.report.pictures import features, fields, loads, scenes, trajectory
from polycube.report.pictures.render import Picture
from polycube.state import RunState
from polycube.types import Goal

logger = logging.getLogger(__name__)

PROCESSES = 2  # number of drawing processes


def makers(state: RunState, problem: Problem | None = None) -> dict[str, Callable[[], Picture]]:
    """Functions that make each picture of a state; `mode_<number>` and similar ones are films.

    problem : supports and loads of the solution, if they are known
    """
    surface, mesh, spline = state.surface, state.hexes, state.spline
    found: dict[str, Callable[[], Picture]]
    found = {"input": partial(scenes.input_surface, surface)}
    blocks = state.ranked[state.chosen].candidate.blocks if state.ranked else None
    if blocks is not None:
        found["section"] = partial(scenes.section, blocks)
    elif state.polycube is not None:
        found["polycube"] = partial(scenes.polycube_faces, state.polycube, state.rough_map)
    if state.labels is not None:
        found["labels"] = partial(scenes.labelled, surface, state.labels)
    proposed = scenes.distinct(state.ranked)
    if len(proposed) > 1:
        found["proposals"] = partial(scenes.sheet, proposed)
    if state.given is not None:
        found["given"] = partial(scenes.hex_cut, state.given)
    if mesh is not None:
        found["hex"] = partial(scenes.hex_outside, mesh)
        found["cut"] = partial(scenes.hex_cut, mesh)
        found["worst"] = partial(scenes.worst_hex, mesh)
        found["deviation"] = lambda: scenes.deviation(mesh, quad_deviation(mesh, surface))
        if len(surface.region):
            goal = state.verdict.goal if state.verdict else Goal()
            found["features"] = partial(features.lost_features, mesh, surface, goal)
        if mesh.sets:
            found["sets"] = partial(features.both_sides, mesh)
        if np.ptp(mesh.cell):  # a single primitive is not divided
            found["cells"] = partial(scenes.decomposed, mesh)
    if state.polycube is not None and state.trajectory is not None:
        denoised = state.polycube, state.trajectory, state.steps
        found["denoising"] = partial(trajectory.Trajectory, *denoised)
    if spline is not None:
        found["spline"] = partial(scenes.spline_boundary, spline)
        if state.solution is not None:
            found |= fields.makers(spline, state.solution)
            if problem is not None and mesh is not None:
                found["problem"] = partial(loads.supports_and_loads, mesh, problem)
    return found


def pictures(state: RunState, problem: Problem | None = None) -> dict[str, bytes]:
    """PNG of all results in the state, GIF of animations."""
    return draw(made(state, problem))


def made(state: RunState, problem: Problem | None = None) -> dict[str, Picture]:
    """Each picture of a state, except, with a warning, those that cannot be made."""
    found = {}
    for name, make in makers(state, problem).items():
        try:
            found[name] = make()
        except Exception as error:
            logger.warning("no picture of %s: %s", name, error)
    return found


def draw(found: Mapping[str, Picture], seconds: float = 120) -> dict[str, bytes]:
    """PNG of each scene, GIF of each film; failed ones are omitted, with a warning."""
    names = list(found)
    shares = [{name: found[name] for name in names[k::PROCESSES]} for k in range(PROCESSES)]
    with ThreadPoolExecutor(PROCESSES) as pool:
        drawn = pool.map(partial(_draw, seconds=seconds), filter(None, shares))
        return {name: image for share in drawn for name, image in share.items()}


def _draw(found: Mapping[str, Picture], seconds: float) -> dict[str, bytes]:
    """Images that one process draws."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    environment["MPLBACKEND"] = "Agg"
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "polycube.report.pictures.render", folder]
        try:
            given = pickle.dumps(dict(found))
            process = subprocess.run(
                command, input=given, capture_output=True, timeout=seconds, env=environment
            )
            reason = process.stderr.decode(errors="replace").strip().splitlines()[-1:]
        except (OSError, subprocess.TimeoutExpired) as error:
            reason = [str(error)]
        paths = sorted(Path(folder).glob("*.[pg][ni][gf]"))
        drawn = {path.stem: path.read_bytes() for path in paths}
    missing = [name for name in found if name not in drawn]
    if missing:
        why = "".join(reason) or "the drawing process ended without a message"
        logger.warning("no picture of %s: %s", ", ".join(missing), why)
    return drawn
