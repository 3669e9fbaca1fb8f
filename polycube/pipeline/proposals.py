"""Candidates of all structure plugins chosen, on all grids chosen."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from polycube.pipeline.stages import Clock
from polycube.registry import build
from polycube.surface.measures import genus
from polycube.types import Candidate, TriMesh

READERS = ("slices", "boxes", "bricks", "given")  # need no network; a given context replaces them


def propose(
    cfg: Mapping[str, object], surface: TriMesh, primitives: Mapping[str, np.ndarray], clock: Clock
) -> tuple[Candidate, ...]:
    """Candidates on each grid, without those that say again what a smaller grid said."""
    candidates: tuple[Candidate, ...] = ()
    for grid in grids(cfg):
        known = {(c.proposal, c.key) for c in candidates}
        made = _propose_on(grid, cfg, surface, primitives, clock)
        candidates += tuple(c for c in made if (c.proposal, c.key) not in known)
    return candidates


def grids(cfg: Mapping[str, object]) -> list[tuple[int, int, int]]:
    """The grid, or those of grid=auto; of these the first that a given context fits."""
    grid, context = cfg["grid"], cfg["context"] or []
    shapes = [tuple(shape) for shape in grid.get("among") or [grid["shape"]]]
    if not context:
        return shapes
    return [shape for shape in shapes if len(context) <= math.prod(shape)][:1] or shapes[-1:]


def no_structure(cfg: Mapping[str, object], surface: TriMesh, proposed: int) -> str:
    """What to say where none of the candidates proposed has the surface's genus."""
    shapes = " or ".join("x".join(map(str, shape)) for shape in grids(cfg))
    alone = cfg["structure"].get("plugin")
    if not proposed and alone and alone not in READERS:
        return (
            f"structure={alone} has no weights for {', '.join(cfg['primitives']['use'])} on a "
            f"{shapes} grid; name weights by ckpt=, or let structure=auto read the part itself"
        )
    return (
        f"no polycube of {', '.join(cfg['primitives']['use'])} on a {shapes} grid fits this "
        f"surface of genus {genus(surface)}; try another grid or more primitives"
    )


def _propose_on(
    grid: tuple[int, int, int],
    cfg: Mapping[str, object],
    surface: TriMesh,
    primitives: Mapping[str, np.ndarray],
    clock: Clock,
) -> tuple[Candidate, ...]:
    """Candidates of the structure plugins; each is told the earlier ones."""
    alone = {cfg["structure"].get("plugin"): cfg["structure"]}
    configs = dict(cfg["structure"].get("proposals") or alone)
    if cfg["context"]:
        denoisers = {n: c for n, c in configs.items() if c["plugin"] not in READERS}
        configs = {"given": {"plugin": "given", "context": cfg["context"]}, **denoisers}
    candidates: tuple[Candidate, ...] = ()
    for name, config in configs.items():
        plugin = build("structure", config, grid=grid, primitives=primitives)
        if getattr(plugin, "any_grid", False) and grid != grids(cfg)[-1]:
            continue
        made = clock.run(f"structure/{name}", lambda p=plugin, c=candidates: p(surface, c))
        candidates += tuple(made)
    return candidates
