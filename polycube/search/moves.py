"""What a search can do next. A move does not know the others.

The class method `possible` of a move gives those that can be made now; `polycube.search.possible`
collects them. A move is equal to another one if it would do the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from polycube.hexmesh.generation import sizing
from polycube.hexmesh.generation.requests import requests_of
from polycube.hexmesh.generation.requests_met import missing
from polycube.hexmesh.inspection import Inspection, inspect
from polycube.hexmesh.settings import creases_of
from polycube.kinds import CountsHexes, FollowsCreases, Subdivide
from polycube.search.chain import merged, with_options
from polycube.search.history import History, Move, Outcome
from polycube.search.unfitted import partly_fitted_state
from polycube.structure.lattice import describe
from polycube.surface.measures import diagonal
from polycube.types import Goal, Tier

SUBDIVIDE = "meshing/subdivide"
FINEST = 1.9  # largest factor on the size; beyond it, refinement needs about as many hexes
STEP = 1.4  # largest factor in one step
MARGIN = 1.05  # additional factor to the prediction that distances are of order h^2
AGAIN = 2  # number of times that a mesh is repeated with other options for one reason


@dataclass(frozen=True)
class Propose(Move):
    """Propose and rank the structures of a tier."""

    tier: Tier

    @classmethod
    def possible(cls, history: History) -> Iterator[Move]:
        """Every tier that is not proposed yet."""
        yield from (cls(tier) for tier in history.task.tiers if tier not in history.proposed)

    def __call__(self, history: History) -> None:
        """Append the structures to the ranked ones."""
        history.proposed.append(self.tier)
        history.ranked += history.task.propose(history.task.start.surface, self.tier)

    def describe(self, history: History) -> str:
        """The name of the tier."""
        return f"propose {self.tier.name.lower()} structures"


@dataclass(frozen=True)
class MeshStructure(Move):
    """Mesh a structure in a variant; structure 0 of no structures is a given hex mesh."""

    structure: int
    variant: int

    @classmethod
    def possible(cls, history: History) -> Iterator[Move]:
        """The next variant of every structure; last resorts only if there are no others."""
        is_last = [entry.candidate.tier == Tier.LAST for entry in history.ranked]
        is_given = history.task.start.hexes is not None
        for number, entry in enumerate(history.ranked or [None] * is_given):
            if is_last[number : number + 1] == [True] and not all(is_last):
                continue
            if history.only not in (None, number):
                continue
            for variant in range(len(history.task.variants(entry))):
                if cls(number, variant) not in history.moves:
                    yield cls(number, variant)
                    break

    def __call__(self, history: History) -> Outcome:
        """Run the stages of the variant."""
        task, has = history.task, bool(history.ranked)
        options = task.variants(history.ranked[self.structure] if has else None)[self.variant]
        start = history.start(self.structure) if has else task.start
        state, results = task.chain.run(task.fit, start, options)
        return history.add(self, state, results, options)

    def describe(self, history: History) -> str:
        """The structure and the number of the variant."""
        if not history.ranked:
            return f"variant {self.variant + 1}"
        candidate = history.ranked[self.structure].candidate
        blocks = candidate.blocks
        name = describe(candidate.polycube) if blocks is None else f"{len(blocks.hexes)} blocks"
        return (
            f"structure {self.structure} ({candidate.proposal}, {name}), variant {self.variant + 1}"
        )


@dataclass(frozen=True)
class Given(Move):
    """The hex mesh from which a run starts."""

    @classmethod
    def possible(cls, history: History) -> Iterator[Move]:
        """Nothing: it is the first outcome."""
        yield from ()

    def __call__(self, history: History) -> Outcome:
        """Take the hexes of the start."""
        return history.add(self, history.task.start, {}, {})

    def describe(self, history: History) -> str:
        """The mesh."""
        return "the given mesh"


@dataclass(frozen=True)
class Cure(Move):
    """Improve the poor hexes of a mesh, which is then expected to be the leading one."""

    of: int

    @classmethod
    def possible(cls, history: History) -> Iterator[Move]:
        """Every fitted mesh that was not cured."""
        kinds = {stage.kind for stage in history.task.cure}
        for outcome in history.outcomes if kinds else ():
            if not outcome.state.unfitted and not kinds & set(outcome.results):
                yield cls(outcome.number)

    def __call__(self, history: History) -> Outcome | None:
        """Run the stages; None if they change nothing."""
        outcome, task = history.outcomes[self.of], history.task
        state, results = task.chain.run(task.cure, outcome.state, outcome.options)
        if state.hexes is outcome.state.hexes:
            return None
        return history.add(self, state, {**outcome.results, **results}, outcome.options)

    def describe(self, history: History) -> str:
        """The number of the mesh."""
        return f"improve the poor hexes of mesh {self.of}"


@dataclass(frozen=True)
class Again(Move):
    """Repeat the leading mesh with other options of the subdivision, for one reason."""

    of: int
    reason: ClassVar[str] = ""

    @classmethod
    def possible(cls, history: History) -> Iterator[Move]:
        """The leading mesh, if there are such options, and if it is not the last of many."""
        leader = history.leader
        if leader is None or leader.state.unfitted:
            return
        before, number = leader.move, 0
        while isinstance(before, Again | Cure):
            number += type(before) is cls
            before = history.outcomes[before.of].move
        options = cls(leader.number).options(history) if number < AGAIN else None
        if options and merged(leader.options, {SUBDIVIDE: options}) != leader.options:
            yield cls(leader.number)

    def options(self, history: History) -> Mapping[str, object] | None:
        """Options of the subdivision; None if there is no reason, or if they are not supported."""
        raise NotImplementedError

    def __call__(self, history: History) -> Outcome:
        """Run the stages that made the mesh with these options."""
        outcome, task = history.outcomes[self.of], history.task
        options = merged(outcome.options, {SUBDIVIDE: self.options(history) or {}})
        start = history.start(outcome.state.chosen) if history.ranked else task.start
        is_cured = {stage.kind for stage in task.cure} & set(outcome.results)
        stages = [*task.fit, *(task.cure if is_cured else ())]
        state, results = task.chain.run(stages, start, options)
        return history.add(self, state, results, options)

    def describe(self, history: History) -> str:
        """The number of the mesh and the reason."""
        return f"mesh {self.of} {self.reason}"

    def subdivision(self, history: History) -> object | None:
        """The plugin that made the hexes."""
        options, stages = history.outcomes[self.of].options, history.task.fit
        plugins = {s.kind: s.plugin for s in with_options(stages, options)}
        return plugins.get(SUBDIVIDE)

    def inspection(self, history: History) -> Inspection:
        """Measurements of the mesh."""
        state = history.outcomes[self.of].state
        assert state.hexes is not None
        return inspect(state.hexes, state.surface)


class Finer(Again):
    """Make hexes smaller for lost features: distances are of order h^2."""

    reason = "with smaller hexes, for lost features"

    def options(self, history: History) -> Mapping[str, object] | None:
        """Options for the predicted size, at most `STEP` times smaller."""
        subdivide = self.subdivision(history)
        if not history.outcomes[self.of].verdict.lost or not isinstance(subdivide, Subdivide):
            return None
        features = self.inspection(history).features
        farthest = max((each.excess(Goal()) for each in features), default=np.inf)
        return subdivide.finer_options(float(np.clip(MARGIN * farthest**0.5, MARGIN, STEP)))


class Closer(Again):
    """Make hexes smaller for the distance `meshing.deviation`, where refinement needs more."""

    reason = "with smaller hexes, for meshing.deviation"

    def options(self, history: History) -> Mapping[str, object] | None:
        """Options for the predicted size."""
        wanted, subdivide = history.task.bundle.get("deviation"), self.subdivision(history)
        if wanted is None or not isinstance(subdivide, Subdivide):
            return None
        found = self.inspection(history)
        unit = diagonal(found.surface)
        times = MARGIN * (found.deviation.p99 * unit / sizing.length(wanted, unit)) ** 0.5
        return subdivide.finer_options(times) if MARGIN < times <= FINEST else None


class AlongCreases(Again):
    """Make hexes smaller along the sharp edges of a surface: mesh edges are chords of curves."""

    reason = "with smaller hexes along sharp edges"

    def options(self, history: History) -> Mapping[str, object] | None:
        """Options for the distance `meshing.creases`."""
        found, subdivide = self.inspection(history), self.subdivision(history)
        requested = creases_of(history.task.bundle.get("creases"), found.surface)
        if requested is None or not isinstance(subdivide, FollowsCreases):
            return None
        unit = diagonal(found.surface)
        wanted = sizing.length(requested, unit) / unit
        return subdivide.crease_options(wanted) if found.creases > wanted else None


class MoreParts(Again):
    """Change the numbers of parts, for the numbers of hexes in `meshing.at`.

    Layers under the boundary are added after the lattice is divided, and count as hexes through a
    wall, so the numbers of parts are known only from the mesh.
    """

    reason = "with other numbers of parts, for meshing.at"

    def options(self, history: History) -> Mapping[str, object] | None:
        """Options for as many parts as hexes are missing, fewer for superfluous ones."""
        subdivide = self.subdivision(history)
        if not isinstance(subdivide, CountsHexes) or not subdivide.at:
            return None
        found = self.inspection(history)
        off = missing(found.mesh, found.surface, requests_of(subdivide.at))
        return subdivide.count_options(off) if any(off) else None


@dataclass(frozen=True)
class FitPartly(Move):
    """Fit the hexes of a structure as far as they stay valid, if no fitted mesh is valid."""

    structure: int

    @classmethod
    def possible(cls, history: History) -> Iterator[Move]:
        """The finest lattice and the best other structure; nothing if there is a sound mesh."""
        leader = history.leader
        if not history.moves or not history.ranked or (leader is not None and leader.key[0] > 0):
            return
        fine = [
            (int(entry.candidate.polycube.occupancy.sum()), number)
            for number, entry in enumerate(history.ranked)
            if entry.candidate.tier >= Tier.FINE
        ]
        yield from (cls(number) for _, number in sorted(fine, reverse=True)[:1])
        yield cls(leader.state.chosen if leader is not None else 0)

    def __call__(self, history: History) -> Outcome | None:
        """Fit the hexes; None if they are not valid before."""
        why = "no mesh was finished"
        if history.leader is not None:
            why = "; ".join(history.leader.verdict.failures)
        state = partly_fitted_state(history.task, history.start(self.structure), why)
        return None if state is None else history.add(self, state, {}, {})

    def describe(self, history: History) -> str:
        """The number of the structure."""
        return f"fit structure {self.structure} as far as its hexes stay valid"


MOVES: tuple[type[Move], ...] = (
    Propose,
    MeshStructure,
    Cure,
    Finer,
    Closer,
    AlongCreases,
    MoreParts,
    FitPartly,
)


def possible(history: History) -> list[Move]:
    """All moves that can be made now and have not been made."""
    return [m for kind in MOVES for m in kind.possible(history) if m not in history.moves]
