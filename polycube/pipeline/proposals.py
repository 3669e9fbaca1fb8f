"""Propose structures: the candidates of the structure plugins, ranked."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial
from typing import Any

import numpy as np

from polycube.errors import InputError, MissingPackage
from polycube.kinds import Ranking, Structure
from polycube.pipeline.choices import drawn_to_compare, has_coarse
from polycube.pipeline.settings import Node, Settings
from polycube.pipeline.stages import Clock
from polycube.registry import build
from polycube.surface.measures import genus
from polycube.types import Candidate, Ranked, TriMesh

logger = logging.getLogger(__name__)

Grid = tuple[int, ...]
Primitives = Mapping[str, np.ndarray]  # voxels (3, 3, 3) by name


@dataclass(frozen=True)
class Proposals:
    """The structures of a part, from all selected structure plugins on all selected grids."""

    settings: Settings
    primitives: Primitives
    ranking: Ranking
    clock: Clock

    def ranked(self, surface: TriMesh) -> list[Ranked]:
        """The structures, the best first; late proposals are among them if no other is coarse.

        Raises
        ------
        InputError
            If no proposal fits the part, or if a given context replaces proposals with options.
        """
        candidates = self.propose(surface)
        found = self._rank(surface, candidates)
        if not has_coarse(found):
            candidates += self.propose(surface, late=True)
            found = self._rank(surface, candidates)
        if not found:
            raise InputError(_explain_none(self.settings, surface, len(candidates)))
        return found

    def with_late(self, surface: TriMesh, ranked: Sequence[Ranked]) -> list[Ranked]:
        """The ranked structures, followed by those of late proposals if there were none yet."""
        if drawn_to_compare(ranked) is not None:
            return list(ranked)
        return [*ranked, *self._rank(surface, self.propose(surface, late=True))]

    def propose(self, surface: TriMesh, late: bool = False) -> tuple[Candidate, ...]:
        """Candidates of each grid, without those of a smaller grid.

        Parameters
        ----------
        late
            Ask the plugins whose proposals are compared with the best mesh of all others, instead
            of these others.
        """
        candidates: tuple[Candidate, ...] = ()
        for grid in grids(self.settings):
            known = {(c.proposal, c.key) for c in candidates}
            made = self._propose_on(grid, surface, late)
            candidates += tuple(c for c in made if (c.proposal, c.key) not in known)
        return candidates

    def _propose_on(self, grid: Grid, surface: TriMesh, late: bool) -> tuple[Candidate, ...]:
        """Candidates of the structure plugins; each receives those of the plugins before it."""
        candidates: tuple[Candidate, ...] = ()
        plugins = _plugins(grid, self.settings, self.primitives)
        for name, plugin in plugins:
            if plugin.late != late or (plugin.any_grid and grid != grids(self.settings)[-1]):
                continue
            try:
                made = self.clock.run(f"structure/{name}", partial(plugin, surface, candidates))
            except MissingPackage as error:
                if len(plugins) == 1:
                    raise InputError(f"structure={name} proposes nothing: {error}") from None
                logger.info("%s: nothing is proposed, because %s", name, error)
                continue
            candidates += tuple(made)
        return candidates

    def _rank(self, surface: TriMesh, candidates: Sequence[Candidate]) -> list[Ranked]:
        return self.clock.run("ranking", lambda: self.ranking(surface, candidates))


def grids(settings: Settings) -> list[Grid]:
    """The grid, or those of grid=auto; with a context, the first one that fits."""
    given = settings.grid["shape"]
    shapes = [tuple(shape) for shape in ([given] if given else settings.grid.get("among", []))]
    if not shapes:
        raise InputError("grid=any is for train.py; a part has a grid of cells, or grid=auto")
    if not settings.context:
        return shapes
    large = [shape for shape in shapes if len(settings.context) <= math.prod(shape)]
    return large[:1] or shapes[-1:]


def _explain_none(settings: Settings, surface: TriMesh, n_proposed: int) -> str:
    """Explain why no candidate has the genus of the surface, and what may help."""
    shapes = " or ".join("x".join(map(str, shape)) for shape in grids(settings))
    named = ", ".join(map(str, settings.primitives["use"]))
    own = dict(_plugins(grids(settings)[-1], settings, {}))
    plugins = own.values()
    if not n_proposed and all(plugin.any_grid for plugin in plugins):
        return (
            f"structure={', '.join(own)} proposes nothing for this surface; verbose=true shows the "
            "reasons, structure=auto tries others"
        )
    if not n_proposed and all(plugin.needs_network for plugin in plugins):
        return (
            f"no trained weights for {named} on a {shapes} grid; give weights with ckpt=, or use "
            "structure=auto, which needs no network"
        )
    return (
        f"no polycube of {named} on a {shapes} grid fits this surface of genus {genus(surface)}; "
        "try another grid or more primitives"
    )


def _plugins(grid: Grid, settings: Settings, primitives: Primitives) -> list[tuple[str, Structure]]:
    """The structure plugins of a run, by name.

    A given context replaces all plugins without a network; those with a network still denoise the
    part for this context.
    """
    own = settings.structure.get("proposals") or {
        str(settings.structure.get("plugin")): settings.structure
    }
    replacing = {**settings.context_structure, "context": settings.context}
    if not settings.context:
        return [(name, _build(config, grid, primitives)) for name, config in own.items()]
    plugins = [("given", _build(replacing, grid, primitives))]
    for name, config in own.items():
        if config["plugin"] == replacing["plugin"]:
            continue
        plugin = _build(config, grid, primitives)
        if plugin.needs_network:
            plugins.append((name, plugin))
        else:
            _check_unused(name, config, plugin, alone=len(own) == 1)
    return plugins


def _build(config: Node, grid: Grid, primitives: Primitives) -> Structure:
    return build("structure", config, grid=grid, primitives=primitives)


def _check_unused(name: str, config: Node, plugin: Any, alone: bool) -> None:
    """Raise InputError if the user set options of a plugin that a context replaces."""
    if alone:
        raise InputError(
            f"structure={name} finds the structure itself, so it cannot be combined with "
            "context=; remove one of them"
        )
    defaults = {field.name: field.default for field in fields(plugin)}
    for option, value in config.items():
        plain = tuple(value) if isinstance(value, list) else value
        if option in defaults and plain != defaults[option]:
            raise InputError(
                f"structure.proposals.{name}.{option} has no effect with context=; remove one "
                "of them"
            )
