"""Descent to labels of lower energy: groups of pieces change their label, best change first."""

from typing import NamedTuple

import numpy as np
from numba import njit

from .energy import Problem, energy

TINY = 1e-9


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
        label[:] = old
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
        label[:] = old
    return best, faults, used
