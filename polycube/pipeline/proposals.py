"""Propose structures: the candidates of the structure plugins, ranked."""

import logging
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property, partial
from typing import Any

import numpy as np

from polycube.errors import InputError, MeshingError, MissingPackage
from polycube.kinds import Ranking, Structure
from polycube.pipeline.settings import Settings
from polycube.registry import build
from polycube.stages import Clock
from polycube.surface.measures import genus
from polycube.types import Candidate, Json, Ranked, Tier, TriMesh

logger = logging.getLogger(__name__)

Grid = tuple[int, ...]
Primitives = Mapping[str, np.ndarray]  # voxels (3, 3, 3) by name


@dataclass
class Proposals:
    """The structures of a part, from the selected structure plugins, one tier after another."""

    settings: Settings
    primitives: Primitives
    ranking: Ranking
    clock: Clock
    _known: dict[Grid, tuple[Candidate, ...]] = field(default_factory=dict)

    @cached_property
    def tiers(self) -> list[Tier]:
        """The tiers of the selected plugins."""
        return sorted({plugin.tier for _, plugin in self._plugins(grids(self.settings)[-1])})

    def __call__(self, surface: TriMesh, tier: Tier) -> list[Ranked]:
        """The ranked structures of a tier, the best first, without those of a smaller grid."""
        seen: set[tuple[str, str]] = set()
        candidates: list[Candidate] = []
        for grid in grids(self.settings):
            made = self._propose(grid, surface, tier)
            candidates += (c for c in made if (c.proposal, c.key) not in seen)
            seen |= {(c.proposal, c.key) for c in made}
        return self.clock.run("ranking", lambda: self.ranking(surface, candidates))

    def explain_none(self, surface: TriMesh) -> str:
        """Explain why no candidate has the genus of the surface, and what may help."""
        n_proposed = sum(map(len, self._known.values()))
        shapes = " or ".join("x".join(map(str, shape)) for shape in grids(self.settings))
        named = ", ".join(map(str, self.settings.primitives["use"]))
        own = dict(self._plugins(grids(self.settings)[-1]))
        plugins = own.values()
        if not n_proposed and all(plugin.any_grid for plugin in plugins):
            none = f"structure={', '.join(own)} proposes nothing for this surface"
            return f"{none}; verbose=true shows the reasons, structure=auto tries others"
        if not n_proposed and all(plugin.needs_network for plugin in plugins):
            remedy = "give weights with ckpt=, or use structure=auto, which needs no network"
            return f"no trained weights for {named} on a {shapes} grid; {remedy}"
        none = f"no polycube of {named} on a {shapes} grid fits this surface"
        return f"{none} of genus {genus(surface)}; try another grid or more primitives"

    def _plugins(self, grid: Grid) -> list[tuple[str, Structure]]:
        """The structure plugins of a run, by name.

        A given context replaces all plugins without a network; those with a network still denoise
        the part for this context. A plugin with an option `context` places it itself.
        """
        settings = self.settings
        made = partial(build, "structure", grid=grid, primitives=self.primitives)
        alone = {str(settings.structure.get("plugin")): settings.structure}
        own = settings.structure.get("proposals") or alone
        if not settings.context:
            return [(name, made(config)) for name, config in own.items()]
        replacing = {**settings.context_structure, "context": settings.context}
        given = [("given", made(replacing))]
        others = {n: config for n, config in own.items() if config["plugin"] != replacing["plugin"]}
        built = {name: made(config) for name, config in others.items()}
        plugins = [] if any(hasattr(plugin, "context") for plugin in built.values()) else given
        for name, plugin in built.items():
            if plugin.needs_network:
                plugins.append((name, plugin))
            else:
                _check_unused(name, others[name], plugin, alone=len(own) == 1)
        return plugins

    def _propose(self, grid: Grid, surface: TriMesh, tier: Tier) -> list[Candidate]:
        """New candidates of the plugins of a tier; each receives those of the plugins before it.

        A plugin that fails or lacks a package proposes nothing, unless it is the only one.
        """
        found: list[Candidate] = []
        plugins = self._plugins(grid)
        for name, plugin in plugins:
            if plugin.tier != tier or (plugin.any_grid and grid != grids(self.settings)[-1]):
                continue
            before = (*self._known.get(grid, ()), *found)
            try:
                found += self.clock.run(f"structure/{name}", partial(plugin, surface, before))
            except (MissingPackage, MeshingError) as error:
                if len(plugins) == 1:
                    raise type(error)(f"structure={name} proposes nothing: {error}") from None
                level = logging.INFO if isinstance(error, MissingPackage) else logging.WARNING
                logger.log(level, "structure=%s proposes nothing: %s", name, error)
        self._known[grid] = (*self._known.get(grid, ()), *found)
        return found


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


def _check_unused(name: str, config: Json, plugin: Any, alone: bool) -> None:
    """Raise InputError if the user set options of a plugin that a context replaces."""
    if alone:
        what = f"structure={name} finds the structure itself"
        why = f"{what}, so it cannot be combined with context="
        raise InputError(why, remedy="remove one of them")
    defaults = {each.name: each.default for each in fields(plugin)}
    for option, value in config.items():
        plain = tuple(value) if isinstance(value, list) else value
        if option in defaults and plain != defaults[option]:
            what = f"structure.proposals.{name}.{option} has no effect with context="
            raise InputError(what, remedy="remove one of them")
