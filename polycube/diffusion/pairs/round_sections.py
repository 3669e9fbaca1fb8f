"""Round sections of features: circles, and slots with round ends, also if others cross them."""

import numpy as np

from polycube.diffusion.pairs.edge_runs import EdgeRuns
from polycube.diffusion.pairs.lattices import STAYS, Feature
from polycube.diffusion.pairs.rounding import FILLET, Fillets, largest_radii
from polycube.types import PerAxis

BRIDGED = 0.6  # share of the length of an interrupted edge that must exist for it to be rounded


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
    next_slab = [
        [_width(knots[a], low[a] - 1, far), _width(knots[a], high[a], far)] for a in (u, v)
    ]
    after = [_width(knots[axis], low[axis] - 1, far), _width(knots[axis], high[axis], far)]
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
        beyond=np.array(next_slab)[np.arange(2), is_high],
        after=np.tile(after, (4, 1)),
        depth=np.full(4, min(side)),
    )


def _width(knots: np.ndarray, slab: int, far: float) -> float:
    return knots[slab + 1] - knots[slab] if 0 <= slab < len(knots) - 1 else far
