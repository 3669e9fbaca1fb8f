"""The pictures of a run: scenes chosen from its state, drawn in another process.

A picture is never worth a run: what cannot be drawn is missing, with one warning.
"""

from __future__ import annotations

import logging
import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from polycube.pipeline.state import RunState
from polycube.report.numbers.quality import quad_deviation
from polycube.report.pictures import fields, scenes, trajectory
from polycube.report.pictures.render import Film, Scene
from polycube.structure.projection import project

logger = logging.getLogger(__name__)


# picture -> what of the state it needs, and how it is made
SCENES: dict[str, tuple[tuple[str, ...], Callable[[RunState], Scene]]] = {
    "input": (("surface",), lambda s: scenes.input_surface(s.surface)),
    "polycube": (
        ("polycube",),
        lambda s: scenes.polycube_faces(s.polycube, s.rough_map),
    ),
    "labels": (("surface", "labels"), lambda s: scenes.labelled(s.surface, s.labels)),
    "given": (("given",), lambda s: scenes.hex_cut(s.given)),
    "hex": (("hexes",), lambda s: scenes.hex_outside(s.hexes)),
    "cut": (("hexes",), lambda s: scenes.hex_cut(s.hexes)),
    "worst": (("hexes",), lambda s: scenes.worst_hex(s.hexes)),
    "deviation": (
        ("hexes", "surface"),
        lambda s: scenes.deviation(s.hexes, quad_deviation(s.hexes, s.surface)),
    ),
    "cells": (("hexes",), lambda s: scenes.decomposed(s.hexes)),
    "spline": (("spline",), lambda s: scenes.spline_boundary(s.spline)),
}


def pictures(state: RunState) -> dict[str, bytes]:
    """PNG of everything in the state that can be shown, GIF of what moves: `mode_<number>`."""
    makers = {name: make for name, (needs, make) in SCENES.items() if _has(state, needs)}
    if _has(state, ("spline", "solution")):
        makers |= fields.makers(state.solution)
    if "cells" in makers and not np.ptp(state.hexes.cell):
        del makers["cells"]  # one primitive is not taken apart
    found = {}
    for name, make in makers.items():
        try:
            found[name] = make(state)
        except Exception as error:
            logger.warning("no picture of %s: %s", name, error)
    return draw(found)


def denoising(state: RunState) -> dict[str, bytes]:
    """`trajectory.png` and `trajectory.gif` where the diffusion model was asked, else nothing."""
    if state.polycube is None or state.trajectory is None:
        return {}
    try:
        regular, _ = project(state.polycube, state.trajectory[-1])
        shown = trajectory.Trajectory(state.trajectory, regular, state.polycube, state.steps)
        return {
            "trajectory.png": trajectory.strip(shown),
            "trajectory.gif": trajectory.animation(shown),
        }
    except Exception as error:
        logger.warning("no picture of the denoising: %s", error)
        return {}


def _has(state: RunState, names: tuple[str, ...]) -> bool:
    return all(getattr(state, name) is not None for name in names)


def draw(found: Mapping[str, Scene | Film], seconds: float = 120) -> dict[str, bytes]:
    """PNG of each scene, GIF of each film; what could not be drawn is missing, with a warning."""
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
        "MPLBACKEND": "Agg",
    }
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "polycube.report.pictures.render", folder]
        try:
            process = subprocess.run(
                command,
                input=pickle.dumps(dict(found)),
                capture_output=True,
                timeout=seconds,
                env=environment,
                check=False,
            )
            reason = process.stderr.decode(errors="replace").strip().splitlines()[-1:]
        except (OSError, subprocess.TimeoutExpired) as error:
            reason = [str(error)]
        drawn = {
            path.stem: path.read_bytes() for path in sorted(Path(folder).glob("*.[pg][ni][gf]"))
        }
    missing = [name for name in found if name not in drawn]
    if missing:
        why = "".join(reason) or "the drawing process ended without a word"
        logger.warning("no picture of %s: %s", ", ".join(missing), why)
    return drawn
