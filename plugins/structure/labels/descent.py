"""Search for labels of minimum energy by descent from several starts.

In a descent, groups of pieces change their label, the best change first.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from .energy import BACKWARDS, PERPENDICULAR, Problem, energy
from .pieces import Pieces

TINY = 1e-9
MANY_ARCS = 200  # number of arcs for the full budget
KICKED = 3  # number of groups changed at random


class Groups(NamedTuple):
    """Pieces that can change their label together: a single one, half a plane, a whole face."""

    start: np.ndarray  # (G + 1,)
    piece: np.ndarray  # members of the groups in sequence
    cut: np.ndarray  # (G,) cut of a plane at the border of the group, or -1
    pairs: np.ndarray  # (K, 2) adjacent groups
    fits: np.ndarray  # (G, 6) 2 if all members face the direction of a label, 0 if one faces away


@njit(cache=True)
def groups_near_faults(
    p: Problem, groups: Groups, label: np.ndarray, sign: np.ndarray
) -> np.ndarray:
    """(G,) groups with pieces at a fault, or pieces beside one; else all groups."""
    at_fault = np.zeros(len(label), np.bool_)
    _, faults = energy(p, label, sign, at_fault)
    found = np.zeros(len(groups.cut), np.bool_)
    if faults == 0 or not at_fault.any():
        found[:] = True
        return found
    near = at_fault.copy()
    for one, other in p.arcs.pieces:
        if at_fault[one] or at_fault[other]:
            near[one] = near[other] = True
    for g in range(len(found)):
        found[g] = near[groups.piece[groups.start[g] : groups.start[g + 1]]].any()
    return found


@njit(cache=True)
def descend(
    p: Problem, groups: Groups, label: np.ndarray, sign: np.ndarray, budget: int
) -> tuple[float, float, int]:
    """Change labels and signs in place while the energy decreases.

    Returns energy, faults and number of evaluations.
    """
    best, faults = energy(p, label, sign, np.zeros(0, np.bool_))
    used = 0
    while used < budget:
        before = best
        best, faults, more = _single(p, groups, label, sign, best, faults)
        used += more
        if best < before - TINY:
            continue
        best, faults, more = _flip(p, label, sign, best, faults)
        used += more
        if best < before - TINY:
            continue
        best, faults, more = _pair(p, groups, label, sign, best, faults)
        used += more
        if best >= before - TINY:
            break
    return best, faults, used


@njit(cache=True)
def _put(groups: Groups, group: int, value: int, label: np.ndarray) -> None:
    """Set the label of a group."""
    for k in range(groups.start[group], groups.start[group + 1]):
        label[groups.piece[k]] = value


@njit(cache=True)
def _single(
    p: Problem, groups: Groups, label: np.ndarray, sign: np.ndarray, best: float, faults: float
) -> tuple[float, float, int]:
    """The best label of one suspect group, with either sign of its cut."""
    at, new, flip, used, least_faults = -1, 0, False, 0, faults
    old = label.copy()
    near = groups_near_faults(p, groups, label, sign)
    for g in range(len(near)):
        if not near[g]:
            continue
        cut = groups.cut[g]
        for value in range(6):
            if groups.fits[g, value] == 0:
                continue
            _put(groups, g, value, label)
            for turn in range(2 if cut >= 0 else 1):
                if turn:
                    sign[cut] = -sign[cut]
                cost, count = energy(p, label, sign, np.zeros(0, np.bool_))
                used += 1
                if turn:
                    sign[cut] = -sign[cut]
                if cost < best - TINY:
                    best, least_faults, at, new, flip = cost, count, g, value, turn == 1
        for k in range(len(label)):
            label[k] = old[k]
    if at >= 0:
        _put(groups, at, new, label)
        if flip:
            sign[groups.cut[at]] = -sign[groups.cut[at]]
    return best, least_faults, used


@njit(cache=True)
def _flip(
    p: Problem, label: np.ndarray, sign: np.ndarray, best: float, faults: float
) -> tuple[float, float, int]:
    """Flip the signs of cuts if the energy decreases."""
    for c in range(len(sign)):
        sign[c] = -sign[c]
        cost, count = energy(p, label, sign, np.zeros(0, np.bool_))
        if cost < best - TINY:
            best, faults = cost, count
        else:
            sign[c] = -sign[c]
    return best, faults, len(sign)


@njit(cache=True)
def _pair(
    p: Problem, groups: Groups, label: np.ndarray, sign: np.ndarray, best: float, faults: float
) -> tuple[float, float, int]:
    """The first labels that lower the energy for two adjacent groups, one of them suspect."""
    used = 0
    old = label.copy()
    near = groups_near_faults(p, groups, label, sign)
    for k in range(len(groups.pairs)):
        g, h = groups.pairs[k]
        if not (near[g] or near[h]):
            continue
        for value in range(36):
            if groups.fits[g, value // 6] < 2 or groups.fits[h, value % 6] < 2:
                continue
            _put(groups, g, value // 6, label)
            _put(groups, h, value % 6, label)
            cost, count = energy(p, label, sign, np.zeros(0, np.bool_))
            used += 1
            if cost < best - TINY:
                return cost, count, used
        for at in range(len(label)):
            label[at] = old[at]
    return best, faults, used


@dataclass(frozen=True, eq=False)
class Labelling:
    """Labels of pieces, and their cost."""

    label: np.ndarray  # (P,) 0..5
    cost: float
    faults: float


def groups(pieces: Pieces, problem: Problem) -> Groups:
    """The groups of pieces; pairs of neighbours are those that are in no common group."""
    members: list[tuple[tuple[int, ...], int]] = [((k,), -1) for k in range(len(pieces.face))]
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
        np.cumsum([0, *map(len, names)]),
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
