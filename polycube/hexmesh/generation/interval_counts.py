"""Numbers of parts of single lattice intervals, from requests at faces of the part.

A registered coarse mesh of the lattice gives the position of a face on the lattice: the edges on
the rim of a hole lie in the intervals around it, and the path from a face to the opposite one
passes through the intervals of the wall. Only the parts of these intervals are changed.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from polycube.hexmesh.cad_faces import model_sets, quads_of_sets
from polycube.hexmesh.connectivity import edges
from polycube.hexmesh.face_groups import measure
from polycube.hexmesh.generation.requests import Request
from polycube.hexmesh.generation.requests_met import check_requests, wall_of
from polycube.hexmesh.generation.sizing import Counts, number_of_hexes
from polycube.hexmesh.generation.template import mesh
from polycube.hexmesh.hex_counts import curve_length, rims, through
from polycube.hexmesh.named_sets import kind_of
from polycube.hexmesh.settings import edges_around
from polycube.structure.rough_map import identity_map
from polycube.surface.measures import half_edges
from polycube.types import HexMesh, Polycube, TriMesh

logger = logging.getLogger(__name__)

THICKER = 1.5  # relative to the wall thickness of a face: longer paths lead through another feature
RARE = 0.05  # of the area of a face: rarer paths are ignored
TINY = 1e-9
SHORT = 0.1  # permitted shortfall for a requested length, in parts


@dataclass(frozen=True, eq=False)
class Demand:
    """Required total number of parts of some intervals.

    The I intervals of the three axes are numbered, x first, then y and z.
    """

    times: np.ndarray  # (I,) weight of each part of an interval
    length: np.ndarray  # (I,) lengths of the intervals in the model, for a requested length
    wanted: float
    is_count: bool = True  # False for a requested length


def demands(
    lattice: Lattice, surface: TriMesh, requests: Sequence[Request], more: Sequence[int] = ()
) -> list[Demand]:
    """Numbers of parts required by the requests.

    Raises InputError if the surface does not have a requested name.

    more : additional parts for each request, negative for fewer; none: the requested numbers
    """
    check_requests(surface, requests)
    quads, on_model = quads_of_sets(lattice.near, surface), model_sets(surface)
    found: list[Demand] = []
    for request, extra in zip(requests, more or [0] * len(requests), strict=True):
        own, wanted = quads[wall_of(on_model, request)], request.wanted(surface)
        if not len(own):
            logger.info("subdivide: no hex of the lattice is at %s", request.at)
        elif request.kind == "around":
            found += lattice.round_rims(own, partial(edges_around, wanted + extra, size=1.0))
        elif request.kind == "through":
            found += lattice.through_walls(own, max(1, wanted + extra))
        else:
            found += lattice.along(own, wanted)
    return found


def least_demands(
    lattice: Lattice,
    surface: TriMesh,
    across_wall: float,
    around_hole: Callable[[float], float],
    requested: Sequence[Demand] = (),
) -> list[Demand]:
    """Numbers of parts required for hexes across every wall and edges around every hole.

    around_hole : number of edges round a hole of a circumference
    requested : demands of requests, which take precedence if they give a number
    """
    walls = lattice.through_all(across_wall)
    sets = quads_of_sets(lattice.near, surface)
    holes = [own for name, own in sets.items() if kind_of(name) == "hole" and len(own)]
    found = walls + [each for own in holes for each in lattice.round_rims(own, around_hole)]
    counted = [each.times for each in requested if each.is_count]
    is_set = sum(counted, np.zeros(len(lattice.parts))) > 0
    return [each for each in found if not (each.times[is_set] > 0).any()]


def with_demands(
    polycube: Polycube, counts: Counts, demands: Sequence[Demand], max_hexes: int
) -> Counts:
    """The smallest counts of the intervals with demands that meet all demands; see `raised`."""
    x, y, z = (number.copy() for number in counts)
    for demand in demands:
        for number, own in zip((x, y, z), _per_axis(demand.times, counts), strict=True):
            number[own > 0] = 1
    return raised(polycube, (x, y, z), demands, max_hexes)


def raised(polycube: Polycube, counts: Counts, demands: Sequence[Demand], max_hexes: int) -> Counts:
    """The counts after adding parts to the intervals with unmet demands.

    The interval with the longest parts gets one more part until the demand is met, or until there
    would be more than `max_hexes`.
    """
    parts = np.concatenate(counts)
    for demand in demands:
        while demand.times @ parts < demand.wanted - 1e-6:
            longest = np.where(demand.times > 0, demand.length / parts, -1.0).argmax()
            parts[longest] += 1
            if number_of_hexes(polycube, _per_axis(parts, counts)) > max_hexes:
                parts[longest] -= 1
                logger.info("subdivide: max_hexes %d allows no more hexes at a face", max_hexes)
                break
    return _per_axis(parts, counts)


def _per_axis(values: np.ndarray, counts: Counts) -> Counts:
    """Split values of all intervals (I,) by axis."""
    x, y, z = np.split(values, np.cumsum([len(number) for number in counts])[:-1])
    return x, y, z


class Lattice:
    """A coarse mesh with the lattice interval of each of its edges.

    near : registered mesh of `template.mesh` with the given parts of each interval
    """

    def __init__(self, polycube: Polycube, near: HexMesh, counts: Counts) -> None:
        self.polycube, self.knots, self.near = polycube, polycube.knots, near
        self.where = mesh(polycube, identity_map(polycube), counts).vertices
        self.parts = np.concatenate(counts)
        self.first = np.cumsum([0, *(len(number) for number in counts)])
        self.length = self.demand(edges(near.hexes), 0.0).length

    def round_rims(self, quads: np.ndarray, wanted: Callable[[float], float]) -> list[Demand]:
        """Demand for a number of edges on each rim of some quads, by its length."""
        x = self.near.vertices
        curves = rims(x, self.near.quads[quads])
        return [self.demand(curve, wanted(curve_length(x, curve))) for curve in curves]

    def along(self, quads: np.ndarray, size: float) -> list[Demand]:
        """Demand for a length of the edges of some quads."""
        total = self.demand(half_edges(self.near.quads[quads]), 0.0)
        eye = np.eye(len(self.parts))
        return [
            Demand(eye[i], total.length, np.ceil(total.length[i] / size - SHORT), is_count=False)
            for i in np.flatnonzero(total.times)
        ]

    def through_walls(self, quads: np.ndarray, wanted: float) -> list[Demand]:
        """Demand for a number of hexes on the paths from some quads to the opposite side.

        Of paths through different intervals, those are used that are not much longer than most.
        """
        passage, length, area = self._passages(quads)
        order = length.argsort()
        usual = length[order][np.searchsorted(np.cumsum(area[order]), area.sum() / 2)]
        found = []
        for each in np.unique(passage, axis=0):
            here = (passage == each).all(axis=1)
            is_wall = np.median(length[here]) <= THICKER * usual
            if is_wall and area[here].sum() >= RARE * area.sum():
                found.append(self._through(each, wanted))
        return found

    def through_all(self, wanted: float) -> list[Demand]:
        """Demand for a number of hexes on all paths from one side to the opposite one."""
        passage, _, _ = self._passages(np.arange(len(self.near.quads)))
        return [self._through(each, wanted) for each in np.unique(passage, axis=0)]

    def _passages(self, quads: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Paths through the lattice from each quad to the opposite side.

        Returns the axis and the two ends on it (N, 3), the length in the model and the area of the
        quad.
        """
        near = self.near
        own, other = near.quads[quads], near.quads[through(near)[1][quads]]
        axis = np.ptp(self.where[own], axis=1).argmin(axis=1)
        row = np.arange(len(axis))
        ends = np.sort([self.where[side].mean(axis=1)[row, axis] for side in (own, other)], axis=0)
        middles = [near.vertices[side].mean(axis=1) for side in (own, other)]
        length = np.linalg.norm(middles[0] - middles[1], axis=1)
        return np.stack([axis, *ends], axis=1), length, measure(near.vertices[own]).area

    def _through(self, passage: np.ndarray, wanted: float) -> Demand:
        axis, (low, high) = int(passage[0]), passage[1:]
        slabs = self.knots[axis][:-1]
        times = np.zeros(len(self.parts))
        times[self.first[axis] + np.flatnonzero((slabs > low - TINY) & (slabs < high - TINY))] = 1
        return Demand(times, self.length, wanted)

    def demand(self, ends: np.ndarray, wanted: float) -> Demand:
        """Demand on edges (E, 2): occurrences of each interval and its length."""
        axis = np.abs(self.where[ends[:, 1]] - self.where[ends[:, 0]]).argmax(axis=1)
        middle = self.where[ends].mean(axis=1)
        interval = np.zeros(len(ends), np.int64)
        for a, knots in enumerate(self.knots):
            own = axis == a
            interval[own] = self.first[a] + np.searchsorted(knots, middle[own, a]) - 1
        number = np.bincount(interval, minlength=len(self.parts))
        places = self.near.vertices[ends]
        apart = np.linalg.norm(places[:, 1] - places[:, 0], axis=1)
        long, times = np.bincount(interval, apart, len(self.parts)), number / self.parts
        return Demand(times, long / np.maximum(times, 1e-300), wanted)
