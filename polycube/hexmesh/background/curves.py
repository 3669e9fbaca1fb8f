"""Curves of a planar graph: chains of its edges between corners, and quad edges along them."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import cKDTree

from polycube.hexmesh.background.arrangement import passed
from polycube.hexmesh.background.cells import Loops
from polycube.hexmesh.settings import edges_around
from polycube.surface.arc_length import lengths

CORNER = np.radians(20)  # turn of a polyline that separates two curves
EVEN = 2.0  # largest ratio of curvatures of an arc, computed from a polyline
SAMPLES = 6  # samples of a curve per wanted edge, and at least for each curve
FACING = 0.8  # cosine between the normals of two curves and the direction between them
STRETCH = 2.0  # largest length of a quad between close curves, relative to its width
GROWTH = 0.3  # increase of the size per distance from a small one
# share of the permitted distance of an edge from its curve, because later stages move its ends
CHORD_SHARE = 0.6
SHORT = 0.05  # of an edge of twice the size: permitted excess length of a curve
GRADED = 1.3  # ratio of the mean to the smallest size from which an arc has edges of both
NEARBY = 0.25  # of a length that is wanted at a place: distance to which it holds
FINEST = 4  # largest factor by which edges between close curves are smaller than wanted


@dataclass(frozen=True, eq=False)
class Curve:
    """A chain of edges of a planar graph."""

    half: np.ndarray  # (N,) half-edges in their order
    points: np.ndarray  # (N + 1, 2) along them; the last is the first if the chain is closed

    @property
    def arc(self) -> np.ndarray:
        """(N + 1,) length up to each point."""
        return lengths(self.points)

    @property
    def is_round(self) -> bool:
        """Whether it is a loop without a corner."""
        step = np.diff(self.points, axis=0)[[-1, 0]]
        sharp = np.dot(*step) < np.cos(CORNER) * np.prod(np.linalg.norm(step, axis=1))
        return bool((self.points[0] == self.points[-1]).all() and not sharp)

    @property
    def turns(self) -> np.ndarray:
        """(N + 1,) turn at each point; 0 at its ends unless it is round."""
        step = np.diff(self.points, axis=0)
        if self.is_round:
            step = np.concatenate([step[-1:], step, step[:1]])
        found = abs((np.diff(np.arctan2(step[:, 1], step[:, 0])) + np.pi) % (2 * np.pi) - np.pi)
        return found if self.is_round else np.concatenate([[0], found, [0]])

    @property
    def turn(self) -> float:
        """Sum of the turns."""
        found = self.turns
        return float(found.sum() - self.is_round * found[-1])

    @property
    def bend(self) -> np.ndarray:
        """(N + 1,) curvature, from the turns at three consecutive points and the edges there."""
        length = np.diff(self.arc)
        around = (np.append(length, length[-1]) + np.append(length[0], length)) / 2
        three = np.ones(3)
        turn, offset = (np.convolve(np.pad(a, 1), three, "valid") for a in (self.turns, around))
        return turn / offset


@dataclass(frozen=True)
class Sizes:
    """Wanted lengths of the edges of quads."""

    size: float  # largest length
    chord: float  # largest distance of an edge from its curve
    across_wall: float  # smallest number of edges across a strip
    around_hole: float | str  # smallest number of edges around a full turn
    # (N, 3) places in the section, and the largest length of edges there
    fine: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    uneven: float = 1.5  # largest ratio of opposite sides of a grid

    def around(self, radius: float) -> float:
        """Smallest number of edges round a circle."""
        sag = min(CHORD_SHARE * self.chord / radius, 1.0)
        wanted = edges_around(self.around_hole, 2 * np.pi * radius, self.size)
        return max(wanted, np.pi / np.arccos(1 - sag))

    def in_quarter(self, radius: float) -> int:
        """Smallest number of edges in a quarter of a circle."""
        return whole(self.around(radius) / 4)

    def chords(self, off: float) -> float:
        """Number of chords of a curve, not rounded, of which a single one is `off` away from it."""
        return float(np.sqrt(off / self.chord))  # a chord is as far as its squared length


def whole(number: float) -> int:
    """A number of edges, rounded up unless it is only slightly larger than a whole one."""
    return int(np.ceil(number - SHORT))


def curves(points: np.ndarray, edges: np.ndarray, marks: np.ndarray, near: float) -> list[Curve]:
    """The curves of a planar graph.

    They end where three edges meet, at sharp turns and at marks (M, 2).
    """
    start = edges.ravel()  # of each half-edge
    inner, one, two = passed(edges, len(points))
    step = points[edges[:, ::-1].ravel()] - points[start]
    step /= np.linalg.norm(step, axis=1, keepdims=True)
    is_end = np.ones(len(points), bool)
    is_end[inner] = -np.einsum("nd,nd->n", step[one], step[two]) < np.cos(CORNER)
    if len(marks):
        off, at = cKDTree(points).query(marks)
        is_end[at[off < near]] = True
    after = np.full(2 * len(edges), -1)  # the half-edge that continues the same curve
    continues = ~is_end[start[one]]
    after[one[continues] ^ 1], after[two[continues] ^ 1] = two[continues], one[continues]
    found, seen = [], np.zeros(len(edges), bool)
    for number in [*np.flatnonzero(is_end[start]).tolist(), *range(0, 2 * len(edges), 2)]:
        if seen[number // 2]:
            continue
        half = [number]
        while (here := int(after[half[-1]])) not in (-1, number):
            half.append(here)
        chain = np.array(half)
        seen[chain // 2] = True
        found.append(Curve(chain, points[np.append(start[chain], start[chain[-1] ^ 1])]))
    return found


def curves_round(chains: list[Curve], cells: Sequence[Loops]) -> list[list[list[int]]]:
    """For each cell and loop the curves around it, by number from 1, negative if reversed."""
    begins = {int(chain.half[0]): n + 1 for n, chain in enumerate(chains)}
    begins |= {int(chain.half[-1]) ^ 1: -(n + 1) for n, chain in enumerate(chains)}
    return [
        [[begins[half] for half in loop.tolist() if half in begins] for loop in loops]
        for loops in cells
    ]


def divided(
    chains: list[Curve], loops: list[list[list[int]]], full: np.ndarray, sizes: Sizes
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Arc lengths (S,) of samples of each curve, and the wanted edge size there (S,).

    full : (C, K) whether each cell is full in each slab
    """
    beside = np.full((len(chains), 2), -1)  # the cell on the left and on the right
    for number, cell in enumerate(loops):
        for signed in (signed for loop in cell for signed in loop):
            beside[abs(signed) - 1, int(signed < 0)] = number
    full = np.concatenate([full, np.zeros((1, full.shape[1]), bool)])
    arcs, wanted = [], []
    for chain in chains:
        arc = chain.arc
        number = max(SAMPLES, int(np.ceil(SAMPLES * arc[-1] / sizes.size)))
        arcs.append((np.arange(number) + 0.5) / number * arc[-1])
        wanted.append(_own_sizes(chain, arcs[-1], sizes))
    counts = [len(arc) for arc in arcs]
    owner = np.repeat(np.arange(len(chains)), counts)
    at = np.concatenate([_at(chain, arc) for chain, arc in zip(chains, arcs, strict=True)])
    places, normals = at[:, 0], at[:, 1]
    size = np.concatenate(wanted)
    if len(sizes.fine):
        off, dot = cKDTree(sizes.fine[:, :2]).query(places)
        fine = sizes.fine[dot, 2]
        size = np.where(off < NEARBY * fine, np.minimum(size, fine), size)
    reach = sizes.across_wall / STRETCH * sizes.size
    one, two = cKDTree(places).query_pairs(reach, output_type="ndarray").T
    offset = places[two] - places[one]
    gap = np.linalg.norm(offset, axis=1)
    here, there = (np.einsum("nd,nd->n", offset, normals[end]) for end in (one, two))
    facing = (abs(here) > FACING * gap) & (abs(there) > FACING * gap)
    one, two, gap, here, there = (each[facing] for each in (one, two, gap, here, there))
    # the strip is on the left of the first curve, or on its right
    inner = beside[owner[one], (here < 0).astype(int)], beside[owner[two], (there > 0).astype(int)]
    outer = beside[owner[one], (here > 0).astype(int)], beside[owner[two], (there < 0).astype(int)]
    is_wall = full[inner[0]] & full[inner[1]] & ~full[outer[0]] & ~full[outer[1]]
    longest = STRETCH * gap / np.where(is_wall.any(axis=1), sizes.across_wall, 1)
    for end in (one, two):
        np.minimum.at(size, end[inner[0] >= 0], longest[inner[0] >= 0])
    size = _graded(places, np.maximum(size, sizes.size / FINEST))
    return list(zip(arcs, np.split(size, np.cumsum(counts)[:-1]), strict=True))


def _own_sizes(chain: Curve, arc: np.ndarray, sizes: Sizes) -> np.ndarray:
    """(S,) edge sizes along a curve at arc lengths, from its length and its curvature."""
    bend = np.maximum(np.interp(arc, chain.arc, chain.bend), 1e-9 / sizes.size)
    turn = 2 * np.pi / bend
    around = np.array([edges_around(sizes.around_hole, each, sizes.size) for each in turn])
    round_ = np.minimum(turn / around, np.sqrt(8 * CHORD_SHARE * sizes.chord / bend))
    return np.minimum(round_, min(sizes.size, float(chain.arc[-1]) / 2))


def _at(chain: Curve, arc: np.ndarray) -> np.ndarray:
    """(S, 2, 2) points of a curve at arc lengths, and normals to its left."""
    known = chain.arc
    edge = np.clip(np.searchsorted(known, arc, side="right") - 1, 0, len(known) - 2)
    step = np.diff(chain.points, axis=0)[edge] / np.diff(known)[edge, None]
    place = chain.points[edge] + (arc - known[edge])[:, None] * step
    return np.stack([place, np.stack([-step[:, 1], step[:, 0]], axis=1)], axis=1)


def _graded(places: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Sizes that grow by at most GROWTH per distance between any two samples."""
    ascending = np.argsort(size, kind="stable")
    small = ascending[size[ascending] < size.max()]
    found = size.copy()
    for chunk in np.array_split(small, len(small) // 256 + 1):
        chunk = chunk[found[chunk] == size[chunk]]  # what reduces another one does so everywhere
        apart = np.linalg.norm(places[:, None] - places[chunk], axis=2)
        found = np.minimum(found, (size[chunk] + GROWTH * apart).min(axis=1, initial=np.inf))
    return found


def _is_even(chain: Curve, size: np.ndarray) -> bool:
    """Whether a curve gets edges of equal length: an arc without a short fine part."""
    mean, inner = len(size) / float((1 / size).sum()), chain.bend[2:-2]
    is_arc = chain.turn > CORNER and len(inner) and inner.max() < EVEN * inner.min()
    return bool(is_arc and (chain.is_round or mean < GRADED * float(size.min())))


def number_of_edges(chain: Curve, arc: np.ndarray, size: np.ndarray, sizes: Sizes) -> int:
    """Number of quad edges along a curve: even, and sufficient for its turn."""
    total = float(chain.arc[-1])
    mean = len(arc) / float((1 / size).sum())
    parts = total / (float(size.min()) if _is_even(chain, size) else mean)
    half = np.round(parts / 2) if chain.turn < CORNER else whole(parts / 2)
    circle = total * 2 * np.pi / max(chain.turn, CORNER)
    least = whole(edges_around(sizes.around_hole, circle, sizes.size) * chain.turn / (4 * np.pi))
    return 2 * int(max(half, least, 3 if (chain.points[0] == chain.points[-1]).all() else 1))


def placed(chain: Curve, arc: np.ndarray, size: np.ndarray, number: int) -> np.ndarray:
    """(number + 1, 2) points along a curve: evenly spaced on an arc, else by wanted size."""
    total = float(chain.arc[-1])
    cumulated = np.append(0, np.cumsum(size**0 if _is_even(chain, size) else 1 / size))
    knots = np.arange(len(arc) + 1) / len(arc) * total
    found = _at(chain, np.interp(np.linspace(0, cumulated[-1], number + 1), cumulated, knots))[:, 0]
    found[0], found[-1] = chain.points[0], chain.points[-1]
    return found
