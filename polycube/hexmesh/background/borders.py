"""Borders of the cells of a section: points along them, rings of quads, structured grids."""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp

from polycube.hexmesh.background.curves import Curve, Sizes, divided, number_of_edges, placed

SQUARE = np.radians((50, 130))  # angles of a corner of a cell with four sides
STRAIGHT = np.radians((150, 210))  # angles without a corner
DENSER = 4  # largest factor by which a number of edges grows to be equal to another
COSTLY = 10.0  # growth of numbers, relative to each, that is not worth one unequal edge less
WIDER = 3.0  # the same for the borders of an annulus
CENTRAL = 0.05  # of its inner diameter: largest distance of their centres
EQUAL = 1e-3  # relative difference of the lengths of equal round curves
DEPTH = 0.4  # of the edge length: depth of a ring before smoothing

Side = list[int]  # curves by number from 1, negative for the opposite direction
Pair = tuple[np.ndarray, np.ndarray]  # curves of two sides, by number from 0
Numbers = np.ndarray  # (N,) numbers of edges along the curves


@dataclass(frozen=True, eq=False)
class Cell:
    """Given data of the quads of a cell."""

    # (Q, 4) quads in rings
    quads: np.ndarray = field(default_factory=lambda: np.zeros((0, 4), np.int64))
    # points of them that may move
    inner: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    # points around the rest, with every second one between quads of twice the size
    loops: tuple[np.ndarray, ...] = ()
    corners: tuple[int, ...] = ()  # its four corners if it becomes a grid


def borders(
    chains: list[Curve], loops: list[list[Side]], full: np.ndarray, sizes: Sizes, has_rings: bool
) -> tuple[np.ndarray, list[Cell]]:
    """Points (P, 2) along the curves and in rings, and the cells.

    chains : curves of the section
    loops : for each cell its loops, the outer one first: curves by number from 1, negative for the
        opposite direction
    full : (C, K) whether each cell is full in each slab
    has_rings : whether cells have a ring of quads along smooth loops
    """
    wanted = divided(chains, loops, full, sizes)
    number = np.array([number_of_edges(c, *w, sizes) for c, w in zip(chains, wanted, strict=True)])
    sides = [four_sides(chains, cell, sizes.uneven) or _annulus(chains, cell) for cell in loops]
    number = balanced(number, equally_round(chains) + [p for each in sides for p in _pairs(each)])
    fine = [placed(c, *w, n) for c, w, n in zip(chains, wanted, number.tolist(), strict=True)]
    points, row = np.unique(np.concatenate(fine), axis=0, return_inverse=True)
    rows = np.split(row.ravel(), np.cumsum([len(each) for each in fine])[:-1])

    def around(side: Side) -> np.ndarray:
        return np.concatenate([rows[n - 1][:-1] if n > 0 else rows[-n - 1][:0:-1] for n in side])

    places, cells = [points], []
    start = len(points)
    for cell, opposite in zip(loops, sides, strict=True):
        size = float(min(wanted[abs(n) - 1][1].min() for loop in cell for n in loop))
        made = [around(loop) for loop in cell]
        is_equal = all(number[a].sum() == number[b].sum() for a, b in _pairs(opposite))
        is_grid = bool(opposite) and is_equal
        if is_grid and len(opposite) == 2:
            found, new = _between(points, made, sizes, size, start)
        elif is_grid:
            corners = tuple(int(around(side)[0]) for side in opposite)
            found, new = Cell(loops=tuple(made), corners=corners), points[:0]
        else:
            smooth = [has_rings and _is_smooth(chains, loop) for loop in cell]
            found, new = _with_rings(points, made, smooth, start)
        cells.append(found)
        places.append(new)
        start += len(new)
    return np.concatenate(places), cells


def equally_round(chains: list[Curve]) -> list[Pair]:
    """Pairs of equally long round curves, such as the borders of equal holes."""
    is_round = np.flatnonzero([chain.is_round for chain in chains])
    length = np.array([chains[n].arc[-1] for n in is_round])
    order = np.argsort(length, kind="stable")
    is_equal = np.diff(length[order]) < EQUAL * length[order[1:]]
    curves = is_round[order, None]
    return list(zip(curves[:-1][is_equal], curves[1:][is_equal], strict=True))


def _with_rings(
    points: np.ndarray, loops: list[np.ndarray], smooth: list[bool], start: int
) -> tuple[Cell, np.ndarray]:
    """A cell with a ring along its smooth loops, and its new points, numbered from `start`."""
    quads, left, new = [Cell().quads], [], [points[:0]]
    for loop, is_smooth in zip(loops, smooth, strict=True):
        if not is_smooth:
            left.append(loop)
            continue
        ahead = points[np.roll(loop, -1)] - points[loop]
        along = points[np.roll(loop, -1)] - points[np.roll(loop, 1)]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        depth = DEPTH * np.linalg.norm(ahead, axis=1).min()
        ring = start + np.arange(len(loop))
        new.append(points[loop] + depth * np.stack([-along[:, 1], along[:, 0]], axis=1))
        quads.append(np.stack([loop, np.roll(loop, -1), np.roll(ring, -1), ring], axis=1))
        left.append(ring)
        start += len(loop)
    added = np.concatenate(new)
    return Cell(np.concatenate(quads), np.arange(start - len(added), start), tuple(left)), added


def _between(
    points: np.ndarray, loops: list[np.ndarray], sizes: Sizes, size: float, start: int
) -> tuple[Cell, np.ndarray]:
    """An annulus in rings; its inner loop has the opposite direction."""
    outer, inner = loops[0], loops[1][::-1]
    middle = points[inner].mean(axis=0)
    turn = [np.arctan2(*(points[loop] - middle).T[::-1]) for loop in (outer, inner)]
    inner = np.roll(inner, -np.argmin(abs((turn[1] - turn[0][0] + np.pi) % (2 * np.pi) - np.pi)))
    width = np.linalg.norm(points[outer] - points[inner], axis=1).mean()
    edge = 2 * np.pi / len(outer) * np.linalg.norm(points[outer] - middle, axis=1).mean()
    wanted = width / max(size, min(edge, sizes.size))
    number = int(max(np.ceil(sizes.across_wall), np.round(wanted)))
    share = (np.arange(1, number) / number)[:, None, None]
    new = ((1 - share) * points[outer] + share * points[inner]).reshape(-1, 2)
    rings = [outer, *(start + np.arange(len(new)).reshape(-1, len(outer))), inner]
    quads = [np.stack([a, np.roll(a, -1), np.roll(b, -1), b], axis=1) for a, b in pairwise(rings)]
    return Cell(np.concatenate(quads), start + np.arange(len(new))), new


def _is_smooth(chains: list[Curve], loop: Side) -> bool:
    """Whether a loop has no sharp corner."""
    angle = angles(chains, loop)
    is_closed = len(loop) == 1 and chains[abs(loop[0]) - 1].is_round
    return is_closed or bool(((angle > STRAIGHT[0]) & (angle < STRAIGHT[1])).all())


def polylines(chains: list[Curve], side: Side) -> list[np.ndarray]:
    """Points (N, 2) along the curves, in their direction."""
    return [chains[abs(n) - 1].points[:: 1 if n > 0 else -1] for n in side]


def angles(chains: list[Curve], loop: Side) -> np.ndarray:
    """(N,) inner angle at the start of each curve of a loop."""
    lines = polylines(chains, loop)
    out = np.array([line[1] - line[0] for line in lines])
    back = np.roll([line[-2] - line[-1] for line in lines], 1, axis=0)
    return (np.arctan2(back[:, 1], back[:, 0]) - np.arctan2(out[:, 1], out[:, 0])) % (2 * np.pi)


def _annulus(chains: list[Curve], cell: list[Side]) -> list[Side]:
    """The outer and the inner curve of a cell between two round ones; else empty."""
    if [len(loop) for loop in cell] != [1, 1]:
        return []
    outer, inner = (chains[abs(loop[0]) - 1] for loop in cell)
    if not (outer.is_round and inner.is_round) or outer.arc[-1] > WIDER * inner.arc[-1]:
        return []
    apart = np.linalg.norm(outer.points[1:].mean(axis=0) - inner.points[1:].mean(axis=0))
    return cell if apart < CENTRAL * inner.arc[-1] / np.pi else []


def four_sides(chains: list[Curve], cell: list[Side], most: float) -> list[Side]:
    """The curves of each side of a cell with four corners and no hole, if the ratio of opposite
    ones is below `most`; else empty.
    """
    if len(cell) > 1:
        return []
    angle = angles(chains, cell[0])
    square = (angle > SQUARE[0]) & (angle < SQUARE[1])
    if square.sum() != 4 or not (square | ((angle > STRAIGHT[0]) & (angle < STRAIGHT[1]))).all():
        return []
    at = np.flatnonzero(square)
    turned = cell[0][at[0] :] + cell[0][: at[0]]
    bounds = [*(at - at[0]).tolist(), len(turned)]
    sides = [turned[a:b] for a, b in pairwise(bounds)]
    length = [sum(float(chains[abs(n) - 1].arc[-1]) for n in side) for side in sides]
    ratios = [length[k] / length[k + 2] for k in (0, 1)]
    return sides if max(max(ratio, 1 / ratio) for ratio in ratios) < most else []


def _pairs(sides: list[Side]) -> list[Pair]:
    """Curves of opposite sides of a grid, or of the two borders of an annulus."""
    rows = [np.abs(side) - 1 for side in sides]
    half = len(rows) // 2
    return list(zip(rows[:half], rows[half:], strict=True))


def balanced(number: Numbers, pairs: list[Pair]) -> Numbers:
    """Numbers of edges, increased as little as possible so that they are equal for both of a pair.

    This is interval assignment as an integer program. Pairs stay unequal where that is impossible,
    or needs many more edges.
    """
    least = number // 2
    while pairs:
        excess, unequal = np.zeros((len(pairs), len(number))), np.eye(len(pairs))
        for row, (one, two) in zip(excess, pairs, strict=True):
            row[one] += 1
            row[two] -= 1
        slack = np.zeros(2 * len(pairs))
        found = milp(
            np.append(1 / least, slack + COSTLY),
            integrality=np.ones(len(least) + len(slack)),
            bounds=Bounds(np.append(least, slack), np.append(DENSER * least, slack + np.inf)),
            constraints=LinearConstraint(np.hstack([excess, unequal, -unequal]), 0, 0),
        )
        half, left = np.split(np.round(found.x).astype(np.int64), [len(number)])
        if not left.any():
            return 2 * half
        is_equal = left.reshape(2, -1).sum(axis=0) == 0
        pairs = [pair for pair, own in zip(pairs, is_equal, strict=True) if own]
    return number
