"""Energy of labels of pieces: misfit of normals, borders, and violations of polycube topology.

The border of a chart consists of quarter turns. Their sum is four to the left along an outer border
and four to the right around a hole. Any other sum, two adjacent opposite labels, and a border that
reverses its direction are faults.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from polycube.structure.lattice import OUTWARD
from polycube.surface.measures import face_areas, face_normals

from .pieces import Arcs, Pieces

FAULT = 0.03  # cost of a fault
OPPOSITE = 0.1  # cost of a label whose direction is opposite to a piece
# 1 - cosine from which a piece is perpendicular, or faces away
PERPENDICULAR, BACKWARDS = 0.95, 1.05
CUT = 0.004  # cost of a border across a plane
ANGLE = 0.01  # cost of hexes with an angle of 0 or 180 degrees at a border
SUFFICIENT = 0.6  # sine of their angle from which there is no cost
CREASED = 0.1  # factor on the cost of a border on a crease


class Problem(NamedTuple):
    """Arrays of the energy."""

    misfit: np.ndarray  # (P, 6)
    lean: np.ndarray  # (P, 6) mean of 1 - cosine between the normals and each label
    weight: np.ndarray  # (A,) cost of each arc between two labels
    joined: np.ndarray  # (A,) cost of each arc between equal labels
    arcs: Arcs


def problem(pieces: Pieces, arcs: Arcs, compactness: float) -> Problem:
    """The energy of labels, with a cost per length of border."""
    areas = face_areas(pieces.surface)
    areas = areas / areas.sum()
    lean = 1 - face_normals(pieces.surface) @ OUTWARD.T
    misfit = np.zeros((len(pieces.face), 6))
    np.add.at(misfit, pieces.piece, areas[:, None] * lean)
    share = np.bincount(pieces.piece, areas)[:, None]
    mean = misfit / share
    misfit = misfit + 0.02 * np.sqrt(share) * mean**2 + OPPOSITE * (mean > PERPENDICULAR)
    weight = compactness * arcs.length * np.where(arcs.is_crease, CREASED, 1.0)
    weight = weight + CUT * (arcs.turn == 0)
    weight = weight + _narrow(arcs.inside / np.where(arcs.turn > 0, 1, 3)) * (arcs.turn != 0)
    return Problem(misfit, mean, weight, _narrow(arcs.inside / 2), arcs)


def _narrow(angle: np.ndarray) -> np.ndarray:
    """Cost of hexes with these angles at an arc."""
    return ANGLE * np.maximum(0.0, 1 - np.sin(angle) / SUFFICIENT)


@njit(cache=True)
def energy(
    p: Problem, label: np.ndarray, sign: np.ndarray, at_fault: np.ndarray
) -> tuple[float, float]:
    """Energy of labels (P,), and their number of faults.

    sign : (2 faces,) 1 or -1: whether a border on a cut of a plane is convex or concave
    at_fault : (P,) output: whether a piece is involved in a fault; empty if not needed
    """
    at_fault[:] = False
    cost, faults = 0.0, 0.0
    for k in range(len(label)):
        cost += p.misfit[k, label[k]]
    arcs, chart = p.arcs, np.arange(len(label))
    outward = np.full(2 * len(arcs.pieces), -1)
    for a in range(len(arcs.pieces)):
        one, other = arcs.pieces[a, 0], arcs.pieces[a, 1]
        if label[one] == label[other]:
            _join(chart, one, other)
            cost += p.joined[a]
            continue
        cost += p.weight[a]
        if label[one] // 2 == label[other] // 2:
            faults += 1.0 + 3.0 * arcs.length[a]
            if len(at_fault):
                at_fault[one] = at_fault[other] = True
        turn = arcs.turn[a]
        if turn == 0:
            turn = sign[arcs.cut[a]] if arcs.cut[a] >= 0 else 1
        inward = 0 if turn > 0 else 1
        outward[2 * a], outward[2 * a + 1] = label[other] ^ inward, label[one] ^ inward
    loop, total = np.arange(len(outward)), np.zeros(len(outward))
    faults += _turns(arcs, label, outward, loop, total)
    faults += _loops(arcs, outward, chart, loop, total, at_fault)
    return cost + FAULT * faults, faults


@njit(cache=True)
def _root(parent: np.ndarray, k: int) -> int:
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k


@njit(cache=True)
def _join(parent: np.ndarray, a: int, b: int) -> None:
    a, b = _root(parent, a), _root(parent, b)
    if a < b:
        parent[b] = a
    else:
        parent[a] = b


@njit(cache=True)
def _turns(
    arcs: Arcs, label: np.ndarray, outward: np.ndarray, loop: np.ndarray, total: np.ndarray
) -> float:
    """Connect the borders at points and add their turns; faults for reversed directions.

    outward : (2 A,) direction, as a label, in which a chart ends at a side of an arc, or -1
    loop, total : (2 A,) changed in place: border of each side of an arc, and its turns
    """
    start, arc, side = arcs.start, arcs.arc, arcs.side
    faults = 0.0
    for n in range(len(start) - 1):
        first, before = -1, -1
        for entry in range(start[n], 2 * start[n + 1] - start[n]):
            at = entry if entry < start[n + 1] else entry - start[n + 1] + start[n]
            if outward[2 * arc[at]] < 0:
                continue
            if before >= 0:
                leave, enter = 2 * arc[before] + side[before], 2 * arc[at] + 1 - side[at]
                own = label[arcs.pieces[arc[before], side[before]]]
                turn = _turn(own, outward[enter], outward[leave])
                if turn == 2:
                    faults += 1.0
                else:
                    total[leave] += turn
                _join(loop, enter, leave)
                if at == first:
                    break
            else:
                first = at
            before = at
    return faults


@njit(cache=True)
def _turn(own: int, one: int, other: int) -> int:
    """Quarter turns to the left of a border from one direction to another; 2 if it reverses.

    own : label of the chart; the directions are those in which it ends there
    """
    if one // 2 == own // 2 or other // 2 == own // 2:
        return 0
    if one // 2 == other // 2:
        return 0 if one == other else 2
    flips = own % 2 + one % 2 + other % 2
    if (own // 2 + 1) % 3 != one // 2:
        flips += 1
    return 1 if flips % 2 == 0 else -1


@njit(cache=True)
def _loops(
    arcs: Arcs,
    outward: np.ndarray,
    chart: np.ndarray,
    loop: np.ndarray,
    total: np.ndarray,
    at_fault: np.ndarray,
) -> float:
    """Faults in the turns of all borders: each chart has one outer border; the others are holes."""
    summed = np.zeros(len(loop))
    for h in range(len(loop)):
        summed[_root(loop, h)] += total[h]
    faults, gain = np.zeros(len(chart)), np.full(len(chart), np.inf)
    for h in range(len(loop)):
        if loop[h] == h and outward[h] >= 0:
            c = _root(chart, arcs.pieces[h // 2, h % 2])
            as_hole, as_outer = abs(summed[h] + 4), abs(summed[h] - 4)
            faults[c] += as_hole
            gain[c] = min(gain[c], as_outer - as_hole)
    result = 0.0
    for c in range(len(chart)):
        if chart[c] == c:
            faults[c] += gain[c] if gain[c] < np.inf else 8.0
            result += faults[c]
    for k in range(len(at_fault)):
        at_fault[k] |= faults[_root(chart, k)] > 0
    return result
