"""What a search works on and starts from, what it has tried, and the best mesh so far."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Protocol

import numpy as np

from polycube.errors import MeshingError, PolycubeError
from polycube.hexmesh.inspection import inspect
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.kinds import Acceptance, Expected
from polycube.search.chain import Chain, Options, Results
from polycube.stages import Stage
from polycube.state import RunState
from polycube.structure.projection import pull_back
from polycube.structure.recognition import read_structure
from polycube.types import HexMesh, Ranked, Tier, TriMesh, Verdict

logger = logging.getLogger(__name__)

NO_MESH = 8.0  # shortfall while there is no mesh; that of a mesh is smaller
NOT_JUDGED = 7.5  # of a mesh on which the acceptance raises an exception
MARGIN = 0.05  # log-likelihood per point by which another polycube must explain points better

Primitives = Mapping[str, np.ndarray]  # (3, 3, 3) voxels by name


class Move(Protocol):
    """A step of a search: a frozen dataclass."""

    text: ClassVar[str] = ""  # the move in words, with its fields in braces

    @classmethod
    def possible(cls, history: History) -> Iterator[Move]:
        """The moves of this class that can be made now, some of which may have been made."""
        yield from ()

    def __call__(self, history: History) -> Outcome | None:
        """Make the move: add structures or a mesh to the history.

        Raises MeshingError if there is no mesh.
        """

    def describe(self, history: History) -> str:
        """The move in words."""
        return self.text.format_map(vars(self))


@dataclass(frozen=True, eq=False)
class Task:
    """What a search works on; it does not change."""

    # state with the surface; with hexes if there are no structures or a run is resumed
    start: RunState
    fit: Sequence[Stage]  # stages that make and fit a mesh
    cure: Sequence[Stage]  # stages that are run only on meshes that are expected to lead then
    bundle: Mapping[str, Any]  # meshing bundle with the variants
    acceptance: Acceptance  # judges meshes
    chain: Chain = field(default_factory=Chain)  # runs stages
    # ranked structures of a tier
    propose: Callable[[TriMesh, Tier], list[Ranked]] = lambda surface, tier: []
    tiers: Sequence[Tier] = ()  # tiers of structures that can be proposed
    primitives: Primitives = field(default_factory=dict)  # (3, 3, 3) voxels by name

    def variants(self, entry: Ranked | None) -> Sequence[Options]:
        """Sets of options with which a structure is meshed, the first one first."""
        name = entry.candidate.variants if entry is not None else "portfolio"
        return self.bundle.get(name) or self.bundle["portfolio"] or [{}]


@dataclass(frozen=True, eq=False)
class Outcome:
    """The mesh of a move."""

    number: int  # number of the outcome in the history
    move: Move
    state: RunState  # with the hexes
    results: Results  # of the stages, by kind
    options: Options  # of the stages
    verdict: Verdict  # of the acceptance
    # the outcome with the larger key is better: sound meshes first, then by the verdict, then by
    # the mean scaled Jacobian
    key: tuple[float, ...]
    jacobian: float  # smallest scaled Jacobian

    @property
    def shortfall(self) -> float:
        """How far the mesh is from the goal."""
        return sum(self.verdict.shortfall.values())


@dataclass(frozen=True)
class Tried:
    """A row of the table of moves."""

    name: str  # the move in words
    expected: Expected  # what was expected of it
    gain: float  # by how much it reduced the shortfall of the best mesh
    work: float  # evaluated coordinates, in units of about a second on one core
    seconds: float
    result: str  # the verdict on its mesh, or why there is none
    hexes: int  # number of hexes, 0 if there is no mesh


@dataclass
class History:
    """Structures, meshes and moves of a search until now."""

    task: Task  # what the search works on
    ranked: list[Ranked] = field(default_factory=list)  # the structures so far
    proposed: list[Tier] = field(default_factory=list)  # the tiers that were proposed
    outcomes: list[Outcome] = field(default_factory=list)  # the meshes so far
    moves: list[Move] = field(default_factory=list)  # the moves so far
    table: list[Tried] = field(default_factory=list)  # what became of them
    errors: list[MeshingError] = field(default_factory=list)  # errors of the moves without a mesh
    leader: Outcome | None = None  # the best mesh
    # the only structure that is meshed, from the start of the task; None: any structure
    only: int | None = None
    _starts: dict[int, RunState] = field(default_factory=dict)

    @property
    def shortfall(self) -> float:
        """How far the best mesh is from the goal."""
        return NO_MESH if self.leader is None else self.leader.shortfall

    @property
    def why_no_mesh(self) -> str:
        """The reasons why no move made a mesh."""
        return "; ".join({str(each): 0 for each in self.errors}) or "no structure was meshed"

    def is_cured(self, outcome: Outcome) -> bool:
        """Whether the stages of the cure were run on a mesh."""
        return any(stage.kind in outcome.results for stage in self.task.cure)

    def start(self, structure: int) -> RunState:
        """State from which a structure is meshed."""
        if structure == self.only:
            return self.task.start
        if structure not in self._starts:
            state = replace(self.task.start, ranked=self.ranked)
            self._starts[structure] = choose(state, structure, self.task.primitives)
        return self._starts[structure]

    def of_structure(self, structure: int) -> list[Outcome]:
        """The outcomes on a structure."""
        return [each for each in self.outcomes if each.state.chosen == structure]

    def add(self, move: Move, state: RunState, results: Results, options: Options) -> Outcome:
        """Judge the mesh of a state, and add it to the outcomes."""
        assert state.hexes is not None
        verdict = judged(self.task.acceptance, state.hexes, state.surface)
        if state.unfitted:
            verdict = replace(verdict, failures=(state.unfitted, *verdict.failures), warnings=())
        found, number = inspect(state.hexes, state.surface), len(self.outcomes)
        mean = float(scaled_jacobian(state.hexes.vertices, state.hexes.hexes).mean())
        key, worst = (float(found.is_sound), *verdict.key, mean), found.scaled_jacobian
        outcome = Outcome(number, move, state, results, options, verdict, key, worst)
        self.outcomes.append(outcome)
        if self.leader is None or outcome.key > self.leader.key:
            self.leader = outcome
        return outcome


def judged(acceptance: Acceptance, hexes: HexMesh, surface: TriMesh) -> Verdict:
    """The verdict of an acceptance; a mesh on which it raises an exception is not valid."""
    try:
        return acceptance(hexes, surface)
    except PolycubeError:
        raise
    except Exception as bug:
        logger.debug("acceptance failed", exc_info=True)
        why = f"acceptance {type(acceptance).__name__} failed: {type(bug).__name__}: {bug}"
        return Verdict((why,), (), (-np.inf,), {"acceptance": NOT_JUDGED})


def choose(state: RunState, index: int, primitives: Primitives) -> RunState:
    """The state in which the ranked structure `index` is the one that is meshed."""
    entry = state.ranked[index]
    state = replace(
        state,
        chosen=index,
        polycube=entry.candidate.polycube,
        rough_map=entry.candidate.rough_map,
        blocks=entry.candidate.blocks,
        parametrization=pull_back(state.surface, entry.hexes, entry.positions),
        trajectory=None,
        steps=(),
        denoised_on=None,
    )
    for candidate in (each.candidate for each in state.ranked):
        if candidate.key == entry.candidate.key and candidate.trajectory is not None:
            denoised, own = candidate.trajectory, candidate.polycube
            state = replace(state, trajectory=denoised, steps=candidate.steps)
            found = read_structure(denoised[-1], own, primitives, MARGIN)
            if found is own:
                return state
            logger.info("denoised as %s, the points lie on %s", own.context, found.context)
            return replace(state, denoised_on=found)
    return state
