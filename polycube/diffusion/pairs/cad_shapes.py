"""CAD features of lattices: round holes, fillets, chamfers, slanted faces, draft."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from polycube.diffusion.pairs import rounding
from polycube.diffusion.pairs.lattices import STAYS, Feature, Lattice
from polycube.diffusion.pairs.rounding import CHAMFER, FILLET, EdgeRuns, Fillets, largest_radii
from polycube.types import PerAxis

DISCS = ("hole", "blind hole", "boss")  # a circle in a square; slots get round ends
FLAT = 0.6  # share of parts whose main axis is their shortest axis
FULL = 0.8  # of the largest radius: limit for a fillet that does not form a circle
BRIDGED = 0.6  # share of the length of an interrupted edge that must exist for it to be rounded


@dataclass(frozen=True)
class CadShapes:
    """Frequencies of CAD features; shares between 0 and 1 unless described otherwise.

    rounds : share of the holes, blind holes and bosses that are round
    turned : share of the parts whose whole section is round
    corners : share of the parts with round corners, seen along their main axis
    radius : largest radius of such corners, in units of the learning frame
    edges : share of the kinds of other edges of a part that have a fillet or a chamfer
    edge_radius : their largest size, in units of the learning frame
    chamfers : share of chamfers among the fillets and chamfers
    slants : share of the parts with one or two slanted planes
    slant : largest slant at an end of a plane, relative to the distance of the next knot; below 0.5
    drafts : share of the parts with a draft along their main axis
    draft : largest draft, as a share of the section, at each end
    """

    rounds: float = 0.8
    turned: float = 0.12
    corners: float = 0.4
    radius: float = 0.6
    edges: float = 0.3
    edge_radius: float = 0.15
    chamfers: float = 0.5
    slants: float = 0.35
    slant: float = 0.45
    drafts: float = 0.15
    draft: float = 0.12

    def round_features(self, lattice: Lattice, rng: np.random.Generator) -> list[Feature]:
        """The features that become round if there is room; equal for the same kind and size.

        The part as a whole may be one of them.
        """
        style: dict[tuple[object, ...], bool] = {}
        chosen = []
        for each in lattice.features:
            size = tuple(np.subtract(each.high, each.low).tolist())
            is_round = style.setdefault((each.kind, *size), bool(rng.random() < self.rounds))
            chosen += [each] if is_round and each.kind in (*DISCS, "slot") else []
        if rng.random() < self.turned:
            chosen.append(Feature("boss", (0, 0, 0), lattice.occupancy.shape, int(rng.integers(3))))
        return chosen

    def shaped(
        self,
        vertices: np.ndarray,
        lattice: Lattice,
        knots: PerAxis,
        rounds: Sequence[Feature],
        rng: np.random.Generator,
    ) -> np.ndarray:
        """(V, 3) points of the surface of the lattice between the knots, with CAD features."""
        lengths = [each[-1] - each[0] for each in knots]
        main = int(np.argmin(lengths) if rng.random() < FLAT else rng.integers(3))
        fillets = self._fillets(rounding.edge_runs(lattice.occupancy, knots), main, rng)
        for feature in rounds:
            fillets = with_round_section(fillets, feature, knots)
        x = rounding.rounded(vertices, fillets)
        if rng.random() < self.slants:
            x = self._slanted(x, knots, rng)
        return self._drafted(x, main, rng) if rng.random() < self.drafts else x

    def _fillets(self, edges: EdgeRuns, main: int, rng: np.random.Generator) -> Fillets:
        """Fillets and chamfers, equal for all edges of a kind."""
        radius, norm = np.zeros(len(edges.axis)), np.full(len(edges.axis), FILLET)
        is_along = edges.axis == main
        for is_kind, share, largest in (
            (is_along & edges.is_convex, self.corners, self.radius),
            (is_along & ~edges.is_convex, self.edges, self.edge_radius),
            (~is_along & edges.is_convex, self.edges, self.edge_radius),
            (~is_along & ~edges.is_convex, self.edges, self.edge_radius),
        ):
            if rng.random() < share:
                radius[is_kind] = largest * rng.uniform(0.2, 1)
                norm[is_kind] = CHAMFER if rng.random() < self.chamfers else FILLET
        return Fillets(edges, np.minimum(radius, FULL * largest_radii(edges)), norm)

    def _slanted(self, x: np.ndarray, knots: PerAxis, rng: np.random.Generator) -> np.ndarray:
        """One or two knot planes displaced by a linear function of the position in them."""
        places = x / [max(abs(each[0]), abs(each[-1])) for each in knots]  # -1 to 1
        moved = x.copy()
        for _ in range(rng.integers(1, 3)):
            axis = int(rng.integers(3))
            number = int(rng.integers(len(knots[axis])))
            around = knots[axis][max(number - 1, 0) : number + 2]
            along = np.delete(np.arange(3), axis)[rng.integers(2)]
            size = self.slant * rng.uniform(-1, 1) * np.diff(around).min()
            weight = np.interp(x[:, axis], around, around == knots[axis][number])
            moved[:, axis] += size * weight * places[:, along]
        return moved

    def _drafted(self, x: np.ndarray, main: int, rng: np.random.Generator) -> np.ndarray:
        """Sections along the main axis scaled linearly from end to end."""
        x, place = x.copy(), x[:, main] / np.abs(x[:, main]).max()
        x[:, np.arange(3) != main] *= 1 + self.draft * rng.uniform(-1, 1) * place[:, None]
        return x


def with_round_section(fillets: Fillets, feature: Feature, knots: PerAxis) -> Fillets:
    """The fillets with those of a round section: a circle for a square section, else a slot.

    If the section is open along the feature, as at the mouth of a slot, its existing edges are
    rounded. If other features remove much of it, the parts between them are rounded.
    """
    edges, radius, norm = fillets
    own = corners(edges, feature)
    there = _slabs(edges, own, feature)
    if not there.any(axis=1).all():
        is_clear = own & edges.is_free.all(axis=1)
        radius = np.where(is_clear, largest_radii(edges), radius)
        return Fillets(edges, radius, np.where(is_clear, FILLET, norm))
    lengths = np.diff(knots[feature.axis])[feature.low[feature.axis] : feature.high[feature.axis]]
    is_bridged = (there @ lengths >= BRIDGED * lengths.sum()).all()
    own_edges = EdgeRuns(*(each[own] for each in edges))
    pieces = [section(feature, knots)] if is_bridged else _pieces(feature, knots, there, own_edges)
    radii = [np.where(own, 0, radius)]
    for number, piece in enumerate(pieces):
        pieces[number] = piece._replace(depth=np.minimum(piece.depth, own_edges.depth.min()))
        radii.append(largest_radii(pieces[number]))
    norm = np.append(norm, np.full(4 * len(pieces), FILLET))
    joined = EdgeRuns(*map(np.concatenate, zip(edges, *pieces, strict=True)))
    return Fillets(joined, np.concatenate(radii), norm)


def _pieces(feature: Feature, knots: PerAxis, there: np.ndarray, own: EdgeRuns) -> list[EdgeRuns]:
    """Sections of a feature, one for each run of slabs with all four edges."""
    axis = feature.axis
    steps = np.diff(np.concatenate([[0], there.all(axis=0), [0]]))
    found = []
    for ends in zip(np.flatnonzero(steps == 1), np.flatnonzero(steps == -1), strict=True):
        first, last = (int(feature.low[axis] + end) for end in ends)
        low, high = list(feature.low), list(feature.high)
        low[axis], high[axis] = first, last
        piece = section(feature._replace(low=tuple(low), high=tuple(high)), knots)
        is_in = (own.span[:, 0] < last) & (own.span[:, 1] > first)
        is_free = own.is_free[is_in] & (own.span[is_in] == [first, last])
        found.append(piece._replace(is_free=np.tile(is_free.all(axis=0), (4, 1))))
    return found


def corners(edges: EdgeRuns, feature: Feature) -> np.ndarray:
    """(E,) which edges are those of the feature along its axis, seen from inside it."""
    own = (edges.axis == feature.axis) & (edges.is_convex == (feature.kind in STAYS))
    for place, axis in enumerate(((feature.axis + 1) % 3, (feature.axis + 2) % 3)):
        own = own & np.isin(edges.line[:, place], (feature.low[axis], feature.high[axis]))
    low, high = feature.low[feature.axis], feature.high[feature.axis]
    return own & (edges.span[:, 0] < high) & (edges.span[:, 1] > low)


def _slabs(edges: EdgeRuns, own: np.ndarray, feature: Feature) -> np.ndarray:
    """(4, n) slabs of a feature in which each edge of its section exists, among its own edges."""
    axis = feature.axis
    u, v = (axis + 1) % 3, (axis + 2) % 3
    slabs = np.arange(feature.low[axis], feature.high[axis])
    first, last = edges.span[own].T[:, :, None]
    is_in = (first <= slabs) & (slabs < last)
    side = (edges.line[own] == [feature.high[u], feature.high[v]]) @ [2, 1]
    return np.array([is_in[side == number].any(axis=0) for number in range(4)])


def section(feature: Feature, knots: PerAxis) -> EdgeRuns:
    """The four edges along the axis of a feature, as if there were no other features."""
    low, high, axis = feature.low, feature.high, feature.axis
    far = sum(each[-1] - each[0] for each in knots)
    u, v = (axis + 1) % 3, (axis + 2) % 3
    is_high = np.array(list(np.ndindex(2, 2)))
    line = np.where(is_high, [high[u], high[v]], [low[u], low[v]])
    widths = [np.r_[far, np.diff(each), far] for each in knots]
    beyond = [[width[low[a]], width[high[a] + 1]] for a, width in enumerate(widths)]
    side = [knots[a][high[a]] - knots[a][low[a]] for a in (u, v)]
    return EdgeRuns(
        axis=np.full(4, axis),
        line=line,
        span=np.tile([low[axis], high[axis]], (4, 1)),
        outward=2 * is_high - 1,
        is_convex=np.full(4, feature.kind in STAYS),
        is_free=np.full((4, 2), True),
        at=np.stack([knots[u][line[:, 0]], knots[v][line[:, 1]]], axis=1),
        ends=np.tile(knots[axis][[low[axis], high[axis]]], (4, 1)),
        side=np.tile(side, (4, 1)),
        beyond=np.array([beyond[u], beyond[v]])[np.arange(2), is_high],
        after=np.tile(beyond[axis], (4, 1)),
        depth=np.full(4, min(side)),
    )
