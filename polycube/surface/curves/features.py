"""The features of a surface: its curves and their end points.

In a CAD model, the curves between two faces, including tangent ones, and the tips of cones. In a
triangle surface, the sharp edges. `polycube.surface.curves.creases` finds both. Some coincide with
others within the tolerance of a mesh.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np

from polycube.surface import arc_length as sliding

EXACT = 1e-5  # of the extent of a curve: tolerance for its points to be on a line or a circle
NEAR = 0.0012  # of the diagonal, 0.4 of the permitted distance of a curve
STEP = 0.004  # spacing of the sample points of a curve
SHORTEST = 0.005  # length of a part of a divided curve; a shorter one would need small hexes


@dataclass(frozen=True, eq=False)
class Crease:
    """A curve of a surface, as a chain of edges; the last point of a loop is its first point."""

    points: np.ndarray  # (N, 3)
    arc: np.ndarray  # (N,) length up to each point
    inside: np.ndarray  # (N - 1,) angle of the solid at each edge, below pi if convex
    ends: tuple[int, int]  # corners; (-1, -1) for a loop
    faces: tuple[int, int] = (0, 0)  # adjacent CAD faces, ascending; equal inside a face
    off: float = 0.0  # distance from the curves that it replaces
    whole: Crease | None = None  # the curve of which it is a part

    @property
    def length(self) -> float:
        """Length of the whole crease."""
        return float(self.arc[-1])

    @property
    def shape(self) -> str:
        """Shape of the whole crease, see `shape_of`."""
        return shape_of(self.points)

    @property
    def samples(self) -> np.ndarray:
        """(S, 3) points on the crease, evenly spaced."""
        return self.at(np.linspace(0, self.length, 9 + int(self.length / STEP)))[0]

    @cached_property
    def size(self) -> float:
        """Half the radius of a circle, or the extent of another crease; of a part, of the whole."""
        if self.whole is not None:
            return self.whole.size
        places = self.samples
        extent = float(np.linalg.norm(places[:, None] - places, axis=2).max())
        if self.shape != "circle":
            return extent
        if self.is_loop:
            return extent / 4
        chord = float(np.linalg.norm(places[-1] - places[0]))
        height = float(np.linalg.norm(places[len(places) // 2] - (places[0] + places[-1]) / 2))
        return min((height / 2 + chord**2 / (8 * height) if height > 0 else extent) / 2, extent)

    @property
    def is_loop(self) -> bool:
        """Whether the crease has no ends."""
        return self.ends[0] < 0

    def at(self, arc: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points (N, 3), unit directions (N, 3) and inside angles (N,) at arc lengths (N,)."""
        arc = np.mod(arc, self.length) if self.is_loop else np.clip(arc, 0, self.length)
        edge = np.clip(np.searchsorted(self.arc, arc, side="right") - 1, 0, len(self.inside) - 1)
        step = np.diff(self.points, axis=0)[edge]
        length = np.diff(self.arc)[edge]
        share = ((arc - self.arc[edge]) / length)[:, None]
        return self.points[edge] + share * step, step / length[:, None], self.inside[edge]

    def piece(self, start: float, end: float) -> Crease:
        """The part between two arc lengths, the second larger than the first.

        The arc lengths of a loop may exceed its length. The ends of the part are not corners.
        """
        arc = self.arc
        if self.is_loop:
            rounds = self.length * np.floor(start / self.length)
            start, end = start - rounds, end - rounds
            arc = np.append(arc[:-1], self.length + arc[:-1])
        inner = arc[(arc > start + EXACT * self.length) & (arc < end - EXACT * self.length)]
        arc = np.concatenate([[start], inner, [end]])
        inside = self.at((arc[1:] + arc[:-1]) / 2)[2]
        points, whole = self.at(arc)[0], self.whole or self
        return replace(
            self, points=points, arc=arc - start, inside=inside, ends=(0, 0), whole=whole
        )

    def nearest(
        self, points: np.ndarray, expected: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Arc lengths (N,) of the closest points, and distances (N,).

        expected : (N,) expected arc lengths, see `arc_length.nearest`
        """
        if expected is None:
            expected = np.full(len(points), np.nan)
        arc, square = sliding.nearest(self.points, self.arc, self.is_loop, points, expected)
        return arc, np.sqrt(square)


@dataclass(frozen=True, eq=False)
class Features:
    """Curves of a surface, their end points, and the tips of cones."""

    creases: tuple[Crease, ...]  # the curves
    corners: np.ndarray  # (C, 3) the end points and the tips
    is_fixed: np.ndarray  # (C,) False for a corner that is only the loose end of one curve
    noise: np.ndarray  # (N, 2) ends of the edges that are sharp only locally
    n_faces: int = 0  # number of CAD faces; 0 for a triangle surface
    tips: Mapping[int, int] = field(default_factory=dict)  # corners at tips, with their CAD faces


def shape_of(points: np.ndarray) -> str:
    """Classify the shape of a polyline.

    Returns "line", "circle" (an arc or a full circle) or "curve".

    points : (N, 3), at least 2 points
    """
    middle = points - points.mean(axis=0)
    extent, axes = np.linalg.svd(middle, full_matrices=False)[1:]
    across = abs(middle @ axes.T).max(axis=0)
    if across[1:].max(initial=0) <= EXACT * extent[0]:
        return "line"
    if len(points) < 5 or across[2] > EXACT * extent[0]:
        return "curve"
    flat = middle @ axes[:2].T
    square = (flat**2).sum(axis=1)  # |p - c|^2 = r^2 is linear in c and r^2 - |c|^2
    solved = np.linalg.lstsq(np.column_stack([2 * flat, np.ones(len(flat))]), square, rcond=None)[0]
    radius = np.sqrt(solved[2] + solved[:2] @ solved[:2])
    off = abs(np.linalg.norm(flat - solved[:2], axis=1) - radius).max()
    return "circle" if off <= EXACT * extent[0] else "curve"


@lru_cache(maxsize=4)
def merged(features: Features) -> np.ndarray:
    """(C,) representative of each corner: the first corner within `NEAR`."""
    found = np.arange(len(features.corners))
    for number, corner in enumerate(features.corners):
        gap = np.linalg.norm(features.corners[:number] - corner, axis=1)
        near = np.flatnonzero((gap <= NEAR) & (found[:number] == np.arange(number)))
        if len(near):
            found[number] = near[0]
    return found


@lru_cache(maxsize=4)
def covered(features: Features) -> np.ndarray:
    """(C,) whether a curve is entirely within `NEAR` of longer curves that are not covered."""
    creases = features.creases
    boxes = [(c.points.min(axis=0) - NEAR, c.points.max(axis=0) + NEAR) for c in creases]
    found = np.zeros(len(creases), bool)
    longer: list[int] = []
    for number in sorted(range(len(creases)), key=lambda k: -creases[k].length):
        crease, (low, high) = creases[number], boxes[number]
        places = crease.at(np.linspace(0, crease.length, 5 + int(crease.length / STEP)))[0]
        gap = np.full(len(places), np.inf)
        for other in longer:
            if (boxes[other][0] <= high).all() and (boxes[other][1] >= low).all():
                gap = np.minimum(gap, creases[other].nearest(places)[1])
        found[number] = (gap <= NEAR).all()
        if not found[number]:
            longer.append(number)
    return found


def divided_at_corners(features: Features) -> Features:
    """The curves of a CAD part, divided at corners of others that they pass closer than `NEAR`.

    The vertex there is needed for the others; a path at its side would leave a strip narrower than
    a hex. The first part keeps the number of its curve, the others follow after all curves.
    """
    own = np.setdiff1d(merged(features), [*features.tips])
    found, further = list(features.creases), []
    for number, crease in enumerate(features.creases if features.n_faces else ()):
        arc, gap = crease.nearest(features.corners[own])
        passed = (gap <= NEAR) & (arc > SHORTEST) & (arc < crease.length - SHORTEST)
        if crease.is_loop or not passed.any():
            continue
        order = np.flatnonzero(passed)[np.argsort(arc[passed], kind="stable")]
        order = order[np.append(True, np.diff(arc[order]) > SHORTEST)]
        cuts = pairwise([0.0, *arc[order].tolist(), crease.length])
        stops = pairwise([crease.ends[0], *own[order].tolist(), crease.ends[1]])
        parts = []
        for cut, ends in zip(cuts, stops, strict=True):
            part = crease.piece(*cut)
            x = np.vstack([features.corners[ends[0]], part.points[1:-1], features.corners[ends[1]]])
            parts.append(replace(part, points=x, arc=sliding.lengths(x), ends=ends))
        found[number] = parts[0]
        further += parts[1:]
    return replace(features, creases=(*found, *further))
