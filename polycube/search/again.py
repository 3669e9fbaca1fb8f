"""Moves that repeat the leading mesh with other options of the subdivision."""

from abc import abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from polycube.hexmesh.generation import sizing
from polycube.hexmesh.generation.requests import requests_of
from polycube.hexmesh.generation.requests_met import missing
from polycube.hexmesh.inspection import Inspection, inspect
from polycube.hexmesh.settings import creases_of
from polycube.search.chain import merged, with_options
from polycube.search.history import History, Move, Outcome
from polycube.surface.measures import diagonal

SUBDIVIDE = "meshing/subdivide"
FINEST = 1.9  # largest factor on the size; beyond it, refinement needs about as many hexes
STEP = 1.4  # largest factor in one step
MARGIN = 1.05  # additional factor to the prediction that distances are of order h^2
AGAIN = 2  # number of times that a mesh is repeated with other options for one reason


@dataclass(frozen=True)
class Again(Move):
    """Repeat the leading mesh with other options of the subdivision, for one reason."""

    of: int
    misses: ClassVar[str] = "wishes"  # part of the shortfall that it reduces

    @classmethod
    def possible(cls, history: History) -> Iterator[Move]:
        """The leading mesh, if there are such options, and if it is not the last of many."""
        leader = history.leader
        if leader is None or leader.state.unfitted:
            return
        before, number = leader.move, 0
        while (of := getattr(before, "of", None)) is not None:  # the mesh that it changed
            number += type(before) is cls
            before = history.outcomes[of].move
        options = cls(leader.number).options(history) if number < AGAIN else None
        if options and merged(leader.options, {SUBDIVIDE: options}) != leader.options:
            yield cls(leader.number)

    @abstractmethod
    def options(self, history: History) -> Mapping[str, object] | None:
        """Options of the subdivision; None if there is no reason, or if they are not supported."""

    def __call__(self, history: History) -> Outcome:
        """Run the stages that made the mesh with these options."""
        outcome, task = history.outcomes[self.of], history.task
        options = merged(outcome.options, {SUBDIVIDE: self.options(history) or {}})
        start = history.start(outcome.state.chosen) if history.ranked else task.start
        stages = [*task.fit, *(task.cure if history.is_cured(outcome) else ())]
        state, results = task.chain.run(stages, start, options)
        return history.add(self, state, results, options)

    def subdivision(self, history: History) -> Any:
        """The plugin that made the hexes; None if the mesh was given."""
        options, stages = history.outcomes[self.of].options, history.task.fit
        return {s.kind: s.plugin for s in with_options(stages, options)}.get(SUBDIVIDE)

    def asked(self, history: History, method: str, value: object) -> Mapping[str, object] | None:
        """Options by a method of the subdivision; None if it does not have the method."""
        return getattr(self.subdivision(history), method, lambda value: None)(value)

    def inspection(self, history: History) -> Inspection:
        """Measurements of the mesh."""
        state = history.outcomes[self.of].state
        assert state.hexes is not None
        return inspect(state.hexes, state.surface)


class Finer(Again):
    """Make hexes smaller for lost features: distances are of order h^2."""

    text = "mesh {of} with smaller hexes, for lost features"
    misses = "features"

    def options(self, history: History) -> Mapping[str, object] | None:
        """Options for the predicted size, at most `STEP` times smaller."""
        verdict = history.outcomes[self.of].verdict
        if not verdict.lost:
            return None
        features = self.inspection(history).features
        large = [each for each in features if each.size >= verdict.goal.detail]
        farthest = max((each.excess(verdict.goal) for each in large), default=np.inf)
        times = float(np.clip(MARGIN * farthest**0.5, MARGIN, STEP))
        return self.asked(history, "finer_options", times)


class Closer(Again):
    """Make hexes smaller for the distance `meshing.deviation`, where refinement needs more."""

    text = "mesh {of} with smaller hexes, for meshing.deviation"

    def options(self, history: History) -> Mapping[str, object] | None:
        """Options for the predicted size."""
        wanted = history.task.bundle.get("deviation")
        if wanted is None:
            return None
        found = self.inspection(history)
        unit = diagonal(found.surface)
        times = MARGIN * (found.deviation.p99 * unit / sizing.length(wanted, unit)) ** 0.5
        return self.asked(history, "finer_options", times) if MARGIN < times <= FINEST else None


class AlongCreases(Again):
    """Make hexes smaller along the sharp edges of a surface: mesh edges are chords of curves."""

    text = "mesh {of} with smaller hexes along sharp edges"

    def options(self, history: History) -> Mapping[str, object] | None:
        """Options for the distance `meshing.creases`."""
        found = self.inspection(history)
        requested = creases_of(history.task.bundle.get("creases"), found.surface)
        if requested is None:
            return None
        unit = diagonal(found.surface)
        wanted = sizing.length(requested, unit) / unit
        return self.asked(history, "crease_options", wanted) if found.creases > wanted else None


class MoreParts(Again):
    """Change the numbers of parts, for the numbers of hexes in `meshing.at`.

    Layers under the boundary are added after the lattice is divided, and count as hexes through a
    wall, so the numbers of parts are known only from the mesh.
    """

    text = "mesh {of} with other numbers of parts, for meshing.at"

    def options(self, history: History) -> Mapping[str, object] | None:
        """Options for as many parts as hexes are missing, fewer for superfluous ones."""
        at = getattr(self.subdivision(history), "at", ())
        if not at:
            return None
        found = self.inspection(history)
        off = missing(found.mesh, found.surface, requests_of(at))
        return self.asked(history, "count_options", off) if any(off) else None
