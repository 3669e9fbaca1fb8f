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

from polycube.report import scenes
from polycube.report.render import Scene

logger = logging.getLogger(__name__)

State = Mapping[str, object]
N_MODES = 4  # drawn

# picture -> what of the state it needs, and how it is made
SCENES: dict[str, tuple[tuple[str, ...], Callable[..., Scene]]] = {
    "input": (("surface",), scenes.input_surface),
    "polycube": (("polycube",), scenes.polycube_faces),
    "labels": (("surface", "labels"), scenes.labelled),
    "hex": (("hexes",), scenes.hex_outside),
    "cut": (("hexes",), scenes.hex_cut),
    "worst": (("hexes",), scenes.worst_hex),
    "spline": (("spline",), scenes.spline_boundary),
}


def pictures(state: State) -> dict[str, bytes]:
    """PNG of everything in the state that can be shown; `mode_<number>` for elastic modes."""
    found = {
        name: make(*(state[key] for key in needs))
        for name, (needs, make) in SCENES.items()
        if all(state.get(key) is not None for key in needs)
    }
    if "polycube" in found:  # as the model lies, where that is known
        found["polycube"] = scenes.polycube_faces(state["polycube"], state.get("rough_map"))
    if state.get("spline") is not None and state.get("modes") is not None:
        modes = state["modes"]
        first = scenes.first_elastic(modes)
        for number in range(first, min(first + N_MODES, len(modes.eigenvalues))):
            found[f"mode_{number}"] = scenes.mode(state["spline"], modes, number)
    return draw(found)


def draw(found: Mapping[str, Scene], seconds: float = 120) -> dict[str, bytes]:
    """PNG of each scene; those that could not be drawn are missing, and a warning says why."""
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
        "MPLBACKEND": "Agg",
    }
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "polycube.report.render", folder]
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
        drawn = {path.stem: path.read_bytes() for path in sorted(Path(folder).glob("*.png"))}
    missing = [name for name in found if name not in drawn]
    if missing:
        why = "".join(reason) or "the drawing process ended without a word"
        logger.warning("no picture of %s: %s", ", ".join(missing), why)
    return drawn
