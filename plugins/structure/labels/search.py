"""Search for labels of minimum energy by descent from several starts."""

from dataclasses import dataclass

import numpy as np

from .descent import Groups, descend, groups_near_faults
from .energy import BACKWARDS, PERPENDICULAR, Problem
from .pieces import Pieces

TINY = 1e-9
MANY_ARCS = 200  # number of arcs for the full budget
KICKED = 3  # number of groups changed at random


@dataclass(frozen=True, eq=False)
class Labelling:
    """Labels of pieces, and their cost."""

    label: np.ndarray  # (P,) 0..5
    cost: float
    faults: float


def groups(pieces: Pieces, problem: Problem) -> Groups:
    """The groups of pieces; pairs of neighbours are those that are in no common group."""
    members: list[tuple[tuple[int, ...], int]] = []
    for k in range(len(pieces.face)):
        members.append(((k,), -1))
    for face in np.unique(pieces.face):
        own = np.flatnonzero(pieces.face == face)
        for turn in range(2):
            for side in (-1, 1):
                half = own[pieces.side[own, turn] == side]
                if len(half):
                    members.append((tuple(half.tolist()), 2 * int(face) + turn))
        members.append((tuple(own.tolist()), -1))
    distinct = {m: cut for m, cut in sorted(members, key=lambda entry: entry[1])}
    names = list(distinct)
    start = np.cumsum([0, *map(len, names)])
    belongs = np.zeros((len(names), len(pieces.face)), bool)
    for row, name in enumerate(names):
        belongs[row, list(name)] = True
    touch = np.zeros((len(pieces.face),) * 2, bool)
    touch[tuple(problem.arcs.pieces.T)] = True
    touch |= touch.T
    linked = (belongs.astype(int) @ touch.astype(int) @ belongs.T.astype(int)) > 0
    linked &= (belongs.astype(int) @ belongs.T.astype(int)) == 0
    lean = np.array([problem.lean[list(name)].max(axis=0) for name in names])
    return Groups(
        start,
        np.concatenate(names).astype(np.int64),
        np.array(list(distinct.values())),
        np.ascontiguousarray(np.argwhere(np.triu(linked, 1))),
        (lean < BACKWARDS).astype(np.int64) + (lean < PERPENDICULAR),
    )


def labellings(
    pieces: Pieces, problem: Problem, kicks: int, budget: int, generator: np.random.Generator
) -> list[Labelling]:
    """Different labellings without faults, the cheapest first; else the best one found.

    kicks : random changes of a labelling without faults from which the search starts again
    budget : largest number of evaluations of the energy; smaller if there are many arcs
    """
    found: dict[bytes, Labelling] = {}
    own = groups(pieces, problem)
    label = problem.misfit.argmin(axis=1).astype(np.int64)
    sign = np.full(2 * (int(pieces.face.max()) + 1), -1, np.int64)
    best: tuple[Labelling, np.ndarray] | None = None
    left = budget // (1 + len(problem.arcs.pieces) // MANY_ARCS)
    while left > 0 and kicks >= 0:
        if best is not None:
            label, sign = _kicked(problem, own, best[0].label, best[1], generator)
        cost, faults, used = descend(problem, own, label, sign, left)
        left -= used
        entry = found.setdefault(label.tobytes(), Labelling(label, cost, faults))
        if best is None or cost < best[0].cost - TINY:
            best = entry, sign
        kicks -= best[0].faults == 0
    ordered = sorted(found.values(), key=lambda entry: entry.cost)
    return [entry for entry in ordered if entry.faults == 0] or ordered[:1]


def _kicked(
    problem: Problem,
    groups: Groups,
    label: np.ndarray,
    sign: np.ndarray,
    generator: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Labels and signs with random changes in some groups, near faults if there are any."""
    label, sign = label.copy(), sign.copy()
    near = groups_near_faults(problem, groups, label, sign)
    for group in generator.choice(np.flatnonzero(near), KICKED):
        allowed = np.flatnonzero(groups.fits[group] > 0)
        if len(allowed):
            members = groups.piece[groups.start[group] : groups.start[group + 1]]
            label[members] = generator.choice(allowed)
        if groups.cut[group] >= 0:
            sign[groups.cut[group]] = generator.choice([-1, 1])
    return label, sign
