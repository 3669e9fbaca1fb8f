"""Requirements for estimate and policy plugins, on a search for a mesh of a block."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from polycube.kinds import Acceptance, Expected
from polycube.search.history import NO_MESH, History, Move, Task
from polycube.search.loop import make
from polycube.search.moves import FitPartly, MeshStructure, Propose, possible
from polycube.stages import Stage
from polycube.state import RunState
from polycube.testing.solids import PLACE, SIDES, claim, solid
from polycube.types import HexMesh, Ranked, Tier, TriMesh, Verdict

SIZES = (40.0, 20.0, 15.0, 12.0)  # edge lengths of the hexes in the variants
GOAL = 100  # a mesh with so many hexes meets the goal: that of the third variant


@dataclass(frozen=True)
class _Block:
    """In place of the meshing stages: the block in hexes of a size."""

    size: float = SIZES[0]

    def __call__(self, *_: object) -> HexMesh:
        return solid(size=self.size).hexes


@dataclass(frozen=True)
class _Count(Acceptance):
    """The mesh with more hexes is better."""

    def __call__(self, hexes: HexMesh, surface: TriMesh) -> Verdict:
        number = len(hexes.hexes)
        missing = {"features": 1 - number / GOAL} if number < GOAL else {}
        return Verdict((), (), (float(number),), missing)


def check_estimate(plugin: Callable) -> None:
    """For each move a gain of at least 0 and a positive work, the same every time."""
    history = _history()
    _check_expected(plugin, history)
    gain = max(plugin(move, history).gain for move in possible(history))
    claim(gain > 0, "something is expected of a move while there is no mesh", gain)
    for move in (Propose(Tier.COARSE), MeshStructure(0, 0), MeshStructure(0, 1)):
        make(history, move, Expected(0.0, 1.0))
        _check_expected(plugin, history)


def check_policy(plugin: Callable) -> None:
    """Possible moves, each one once, until there is a mesh and no move is worth its work."""
    history = _history()
    for move, expected in _moves(plugin, history):
        claim(move in possible(history), "a move is possible, and was not made before", move)
        claim(history.shortfall > 0, "no move follows when the goal is met", move)
        _check_values(expected, move)
        make(history, move, expected)
    claim(history.leader is not None, "the block is meshed", history.moves)
    claim(history.shortfall < NO_MESH, "the best mesh has a smaller shortfall than none")
    found = list(plugin(replace(history, moves=[], leader=None), lambda: []))
    claim(not found, "there is no move if none is possible", found)


def _moves(plugin: Callable, history: History) -> Iterator[tuple[Move, Expected]]:
    """The moves of a policy, which does not make them."""
    policy = plugin(history, lambda: possible(history))
    while True:
        before = len(history.moves), len(history.outcomes)
        found = next(policy, None)
        after = len(history.moves), len(history.outcomes)
        claim(after == before, "a policy makes no move itself", history.moves)
        if found is None:
            return
        yield found


def _check_expected(plugin: Callable, history: History) -> None:
    for move in (*possible(history), FitPartly(0)):
        expected = plugin(move, history)
        _check_values(expected, move)
        claim(plugin(move, history) == expected, "the same is expected every time", move)


def _check_values(expected: object, move: Move) -> None:
    if not isinstance(expected, Expected):
        raise AssertionError(f"the result is an Expected; got {type(expected).__name__}")
    gain, work = expected.gain, expected.work
    claim(np.isfinite(gain) and gain >= 0, f"the gain of {move} is 0 or more", gain)
    claim(np.isfinite(work) and work > 0, f"the work of {move} is positive", work)


def _history() -> History:
    """A search for a mesh of the block, before its first move."""
    bundle = {"portfolio": [{"meshing/subdivide": {"size": size}} for size in SIZES]}
    stages = [Stage("meshing/subdivide", _Block())]
    start = RunState(solid().surface)
    return History(Task(start, stages, (), bundle, _Count(), propose=_propose, tiers=[Tier.COARSE]))


def _propose(surface: TriMesh, tier: Tier) -> list[Ranked]:
    """The block itself."""
    part = solid()
    positions = (part.hexes.vertices - PLACE) / SIDES
    return [Ranked(replace(part.candidate, tier=tier), 1.0, {}, part.hexes, positions)]


SEARCH = {"estimate": check_estimate, "policy": check_policy}
