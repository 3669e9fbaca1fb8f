"""Round sections of features: discs, and slots with round ends, also where others cross them."""

from __future__ import annotations

import numpy as np

from polycube.diffusion.pairs.edge_runs import EdgeRuns
from polycube.diffusion.pairs.lattices import STAYS, Feature
from polycube.diffusion.pairs.rounding import FILLET, Fillets, largest_radii
from polycube.types import PerAxis

BRIDGED = 0.6  # of the length of an edge that others cross: what must be there for it to be round


def with_round_section(fillets: Fillets, feature: Feature, knots: PerAxis) -> Fillets:
    """The fillets, the section of a feature round: a disc where it is a square, else a slot.

    Where the section is open, as at the mouth of a slot, the edges that it has become round.
    Where too much of it is cut away by others it stays as it is.
    """
    edges, radius, norm = fillets
    own = corners(edges, feature)
    whole = section(feature, knots)
    covered = _covered(edges, own, whole)
    if (covered == 0).any():
        is_clear = own & edges.is_free.all(axis=1)
        radius = np.where(is_clear, largest_radii(edges), radius)
        return Fillets(edges, radius, np.where(is_clear, FILLET, norm))
    if (covered < BRIDGED).any():
        return fillets
    whole = whole._replace(depth=np.minimum(whole.depth, edges.depth[own].min()))
    return Fillets(
        EdgeRuns(*map(np.concatenate, zip(edges, whole, strict=True))),
        np.append(np.where(own, 0, radius), largest_radii(whole)),
        np.append(norm, np.full(4, FILLET)),
    )


def corners(edges: EdgeRuns, feature: Feature) -> np.ndarray:
    """(E,) which edges are those of the feature along its axis, seen from inside it."""
    own = (edges.axis == feature.axis) & (edges.is_convex == (feature.kind in STAYS))
    for place, axis in enumerate(((feature.axis + 1) % 3, (feature.axis + 2) % 3)):
        own = own & np.isin(edges.line[:, place], (feature.low[axis], feature.high[axis]))
    low, high = feature.low[feature.axis], feature.high[feature.axis]
    return own & (edges.span[:, 0] < high) & (edges.span[:, 1] > low)


def _covered(edges: EdgeRuns, own: np.ndarray, whole: EdgeRuns) -> np.ndarray:
    """(4,) share of each edge of a section that there is, among its own edges."""
    lengths = np.where(own, np.diff(edges.ends).ravel(), 0)
    found = [lengths[(edges.line == line).all(axis=1)].sum() for line in whole.line]
    return np.array(found) / np.diff(whole.ends).ravel()


def section(feature: Feature, knots: PerAxis) -> EdgeRuns:
    """The four edges along the axis of a feature, as if nothing crossed them or came inside."""
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
