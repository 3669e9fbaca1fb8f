"""Pictures of the diffusion process: from a polycube to a geometry, and back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from matplotlib.figure import Figure

from docs.generators.theory.search import searched
from polycube.diffusion.pairs.pairs import Pair
from polycube.diffusion.process import DiffusionProcess
from polycube.io.atomic import atomic_write
from polycube.registry import build
from polycube.report.pictures.colours import PLACES, ramp
from polycube.report.pictures.pictures import draw
from polycube.report.pictures.render import view
from polycube.report.pictures.trajectory import Trajectory

GRID = (2, 1, 1)
PRIMITIVES = ("cube", "hole_z")
CONTEXT = ("cube", "hole_z")
NOISE = 0.25  # s, the standard deviation of the noise
SHOWN = (0, 50, 150, 250, 350, 500)  # steps t in the picture


def states(pair: Pair) -> dict[str, np.ndarray]:
    """Points x_t (N, 3) of equation 2 at the shown steps, and the geometry."""
    process = DiffusionProcess(build("schedule", {"plugin": "linear"})(), NOISE)
    x_0, geometry = (torch.tensor(p.T[None]) for p in (pair.polycube, pair.geometry))
    z = torch.randn(x_0.shape, generator=torch.Generator().manual_seed(0), dtype=x_0.dtype)
    q = process.adjustment(geometry)
    found = {
        f"$x_{{{t}}}$": process.forward(x_0, z, q, torch.tensor([t])).numpy()[0].T for t in SHOWN
    }
    return {**found, "geometry": pair.geometry}


def forward(path: Path) -> None:
    """Write a strip of the states of the forward process of one pair."""
    used = {name: build("primitive", {"plugin": name})() for name in PRIMITIVES}
    pairs = build("data", {"plugin": "paired"})(GRID, used, 1)
    pair = next(p for p in map(pairs, range(100)) if p.context == CONTEXT)
    shown = states(pair)
    figure = Figure((1.7 * len(shown), 1.7), dpi=100, layout="constrained")
    along = pair.polycube[:, 0]
    colours = ramp((along - along.min()) / np.ptp(along), PLACES) / 255
    for axes, (name, points) in zip(figure.subplots(1, len(shown)), shown.items(), strict=True):
        seen = points @ view().T
        order = seen[:, 2].argsort()
        axes.scatter(*seen[order, :2].T, 3, colours[order], linewidths=0)
        axes.set(aspect="equal", xlim=(-1.5, 1.5), ylim=(-1.2, 1.2), title=name)
        axes.set_axis_off()
    with atomic_write(path) as temporary:
        figure.savefig(temporary, format="png", pil_kwargs={"optimize": True})


def backward(path: Path) -> None:
    """Write a strip of the recorded states of Algorithm 2 on an example part."""
    paper = "structure=paper", "context=[cube,hole_z]", "order=[meshing]"
    state = searched("example:rod", *paper, "meshing.size=12%", "effort=first")[1]
    assert state.polycube is not None and state.trajectory is not None
    strip = Trajectory(state.polycube, state.trajectory, state.steps)
    with atomic_write(path) as temporary:
        temporary.write_bytes(draw({"strip": strip})["strip"])
