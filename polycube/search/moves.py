"""What a search can do next. A move does not know the others.

The class method `possible` of a move gives those that can be made now, and the function `possible`
collects them. A move is equal to another one if it would do the same.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from polycube.search.again import AlongCreases, Closer, Finer, MoreParts
from polycube.search.history import History, Move, Outcome
from polycube.search.unfitted import partly_fitted_state
from polycube.structure.lattice import describe
from polycube.types import Tier


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
        task = history.task
        entry = history.ranked[self.structure] if history.ranked else None
        start = history.start(self.structure) if entry else task.start
        options = task.variants(entry)[self.variant]
        state, results = task.chain.run(task.fit, start, options)
        return history.add(self, state, results, options)

    def describe(self, history: History) -> str:
        """The structure and the number of the variant."""
        if not history.ranked:
            return f"variant {self.variant + 1}"
        candidate = history.ranked[self.structure].candidate
        blocks = candidate.blocks
        name = describe(candidate.polycube) if blocks is None else f"{len(blocks.hexes)} blocks"
        variant = f"variant {self.variant + 1}"
        return f"structure {self.structure} ({candidate.proposal}, {name}), {variant}"


@dataclass(frozen=True)
class Given(Move):
    """The hex mesh from which a run starts, as its first outcome."""

    text = "the given mesh"

    def __call__(self, history: History) -> Outcome:
        """Take the hexes of the start."""
        return history.add(self, history.task.start, {}, {})


@dataclass(frozen=True)
class Cure(Move):
    """Improve the poor hexes of a mesh, which is then expected to be the leading one."""

    of: int
    text = "improve the poor hexes of mesh {of}"

    @classmethod
    def possible(cls, history: History) -> Iterator[Move]:
        """Every fitted mesh that was not cured."""
        for outcome in history.outcomes if history.task.cure else ():
            if not outcome.state.unfitted and not history.is_cured(outcome):
                yield cls(outcome.number)

    def __call__(self, history: History) -> Outcome | None:
        """Run the stages; None if they change nothing."""
        outcome, task = history.outcomes[self.of], history.task
        state, results = task.chain.run(task.cure, outcome.state, outcome.options)
        if state.hexes is outcome.state.hexes:
            return None
        return history.add(self, state, {**outcome.results, **results}, outcome.options)


@dataclass(frozen=True)
class FitPartly(Move):
    """Fit the hexes of a structure as far as they stay valid, if no fitted mesh is valid."""

    structure: int
    text = "fit structure {structure} as far as its hexes stay valid"

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


MESH_AGAIN: tuple[type[Move], ...] = (Finer, Closer, AlongCreases, MoreParts)
MOVES: tuple[type[Move], ...] = (Propose, MeshStructure, Cure, *MESH_AGAIN, FitPartly)


def possible(history: History) -> list[Move]:
    """All moves that can be made now and have not been made."""
    return [m for kind in MOVES for m in kind.possible(history) if m not in history.moves]
