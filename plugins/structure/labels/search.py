"""Search for labels of least energy: groups of pieces take other labels, the best change first."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from .energy import Problem, energy
from .pieces import Pieces

TINY = 1e-9
USUAL = 60  # pieces


@dataclass(frozen=True, eq=False)
class Labelling:
    """Labels of pieces, and what they cost."""

    label: np.ndarray  # (P,) 0..5
    cost: float
    faults: float


@dataclass(frozen=True, eq=False)
class Groups:
    """Pieces that may take a label together: one, half a plane, a whole face."""

    start: np.ndarray  # (G + 1,)
    piece: np.ndarray  # members of the groups, one after the other
    cut: np.ndarray  # (G,) cut of a plane that bounds the group, or -1
    pairs: np.ndarray  # (K, 2) groups side by side


def groups(pieces: Pieces, problem: Problem) -> Groups:
    """The groups of pieces; pairs of neighbours are those that no other group holds both of."""
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
    touch[tuple(problem.pieces.T)] = True
    touch |= touch.T
    linked = (belongs.astype(int) @ touch.astype(int) @ belongs.T.astype(int)) > 0
    linked &= (belongs.astype(int) @ belongs.T.astype(int)) == 0
    return Groups(
        start,
        np.concatenate(names).astype(np.int64),
        np.array(list(distinct.values())),
        np.argwhere(np.triu(linked, 1)),
    )


def labellings(
    pieces: Pieces, problem: Problem, kicks: int, budget: int, generator: np.random.Generator
) -> list[Labelling]:
    """Different labellings without faults, the cheapest first; else the best one found.

    kicks : random changes of the best labelling from which the search starts again
    budget : evaluations of the energy at most; fewer where there are many pieces
    """
    found: dict[bytes, Labelling] = {}
    own = groups(pieces, problem)
    start = problem.misfit.argmin(axis=1).astype(np.int64)
    sign = np.full(2 * (int(pieces.face.max()) + 1), -1, np.int64)
    best: tuple[float, np.ndarray, np.ndarray] | None = None
    left = budget // (1 + len(pieces.face) // USUAL)
    for kick in range(kicks + 1):
        label, signs = start.copy(), sign.copy()
        if kick and best is not None:
            label, signs = best[1].copy(), best[2].copy()
            for group in generator.choice(len(own.cut), 3):
                members = own.piece[own.start[group] : own.start[group + 1]]
                label[members] = generator.integers(6)
        cost, faults, used = _descend(
            problem, own.start, own.piece, own.cut, own.pairs, label, signs, left
        )
        left -= used
        found.setdefault(label.tobytes(), Labelling(label, cost, faults))
        if best is None or cost < best[0] - TINY:
            best = cost, label, signs
        if left <= 0:
            break
    ordered = sorted(found.values(), key=lambda entry: entry.cost)
    return [entry for entry in ordered if entry.faults == 0] or ordered[:1]


@njit(cache=True)
def _descend(
    p: Problem,
    start: np.ndarray,
    piece: np.ndarray,
    cut: np.ndarray,
    pairs: np.ndarray,
    label: np.ndarray,
    sign: np.ndarray,
    budget: int,
) -> tuple[float, float, int]:
    """Change labels and signs in place while the energy sinks; energy, faults and evaluations."""
    best, faults = energy(p, label, sign)
    used = 0
    while used < budget:
        before = best
        best, faults, more = _single(p, start, piece, cut, label, sign, best, faults)
        used += more
        if best < before - TINY:
            continue
        best, faults, more = _flip(p, label, sign, best, faults)
        used += more
        if best < before - TINY:
            continue
        best, faults, more = _pair(p, start, piece, pairs, label, sign, best, faults, budget - used)
        used += more
        if best >= before - TINY:
            break
    return best, faults, used


@njit(cache=True)
def _single(
    p: Problem,
    start: np.ndarray,
    piece: np.ndarray,
    cut: np.ndarray,
    label: np.ndarray,
    sign: np.ndarray,
    best: float,
    faults: float,
) -> tuple[float, float, int]:
    """The best label of one group, with either sign of its cut."""
    at, new, flip, used, wrong = -1, 0, False, 0, faults
    old = label.copy()
    for g in range(len(cut)):
        for value in range(6):
            for turn in range(2 if cut[g] >= 0 else 1):
                label[piece[start[g] : start[g + 1]]] = value
                if turn:
                    sign[cut[g]] = -sign[cut[g]]
                cost, count = energy(p, label, sign)
                used += 1
                if turn:
                    sign[cut[g]] = -sign[cut[g]]
                if cost < best - TINY:
                    best, wrong, at, new, flip = cost, count, g, value, turn == 1
                label[:] = old
    if at >= 0:
        label[piece[start[at] : start[at + 1]]] = new
        if flip:
            sign[cut[at]] = -sign[cut[at]]
    return best, wrong, used


@njit(cache=True)
def _flip(
    p: Problem, label: np.ndarray, sign: np.ndarray, best: float, faults: float
) -> tuple[float, float, int]:
    """Flip the signs of cuts while that helps."""
    for c in range(len(sign)):
        sign[c] = -sign[c]
        cost, count = energy(p, label, sign)
        if cost < best - TINY:
            best, faults = cost, count
        else:
            sign[c] = -sign[c]
    return best, faults, len(sign)


@njit(cache=True)
def _pair(
    p: Problem,
    start: np.ndarray,
    piece: np.ndarray,
    pairs: np.ndarray,
    label: np.ndarray,
    sign: np.ndarray,
    best: float,
    faults: float,
    budget: int,
) -> tuple[float, float, int]:
    """The first labels of two groups side by side that lower the energy."""
    used = 0
    old = label.copy()
    for k in range(len(pairs)):
        g, h = pairs[k]
        for value in range(36):
            label[piece[start[g] : start[g + 1]]] = value // 6
            label[piece[start[h] : start[h + 1]]] = value % 6
            cost, count = energy(p, label, sign)
            used += 1
            if cost < best - TINY:
                return cost, count, used
        label[:] = old
        if used > budget:
            break
    return best, faults, used
