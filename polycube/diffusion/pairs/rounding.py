"""Fillets and chamfers of lattice edges as a map of space, exact on the sides of an edge.

For an edge of radius r, let y be the distances from the centre of the arc divided by r: the sides
of the edge are |y|_inf = 1, the edge is (1, 1). The square ring |y|_inf = m is mapped to the ring
|y|_2 = m of a fillet, or |y|_1 = m of a chamfer:

    y -> y m / |y|_p

Four edges of a square section with the largest radius thus form a circle. Outside, the map fades
out between a third of the distance to the next knot and that knot; inside, up to the depth of the
next feature; along the edge, beyond its ends. The planes of other knots are therefore unchanged.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from polycube.diffusion.pairs.edge_runs import EdgeRuns

FILLET, CHAMFER = 2, 1  # the norm p
EXTENT = 1 / 3  # of the distance to the next knot: extent of the rings
DEEPEST = 0.6  # of a radius: largest depth of the next feature inside


class Fillets(NamedTuple):
    """Edges that are rounded."""

    edges: EdgeRuns
    radius: np.ndarray  # (E,) 0: sharp
    norm: np.ndarray  # (E,) FILLET or CHAMFER


def largest_radii(edges: EdgeRuns) -> np.ndarray:
    """(E,) radius of each edge at which it meets its neighbours in the middle of a side."""
    return np.minimum(edges.side.min(axis=1) / 2, edges.depth / (1 - DEEPEST))


def rounded(vertices: np.ndarray, fillets: Fillets) -> np.ndarray:
    """(V, 3) points of a lattice after rounding its edges.

    The axis with the largest roundings is last, so that a chamfered hole or boss becomes round.
    """
    edges, radius, _ = fillets
    much = [radius[edges.axis == axis].sum() for axis in range(3)]
    x = vertices.copy()
    for axis in np.argsort(much, kind="stable"):
        used = (edges.axis == axis) & (radius > 0)
        if used.any():
            _move_along(int(axis), x, fillets, used)
    return x


def _move_along(axis: int, x: np.ndarray, fillets: Fillets, used: np.ndarray) -> None:
    """Move the points x by the used edges, all along one axis."""
    edges, radius = fillets.edges, fillets.radius[used]
    run_out = np.where(edges.is_free[used], np.inf, radius[:, None])
    after = np.minimum(edges.after[used], run_out)
    inner = np.maximum(1 - edges.depth[used] / radius, 0)
    sizes = np.column_stack([radius, fillets.norm[used], inner])
    order = np.array([(axis + 1) % 3, (axis + 2) % 3, axis])
    places = (edges.at[used], edges.outward[used], edges.ends[used])
    _move(x, order, *places, edges.beyond[used], after, sizes)


@njit(cache=True)
def _move(
    x: np.ndarray,
    order: np.ndarray,
    at: np.ndarray,
    outward: np.ndarray,
    ends: np.ndarray,
    beyond: np.ndarray,
    after: np.ndarray,
    sizes: np.ndarray,
) -> None:
    """Sum of the displacements of each point by all edges along one axis."""
    for v in range(len(x)):
        u, w, along = x[v, order[0]], x[v, order[1]], x[v, order[2]]
        for e in range(len(at)):
            radius, norm, inner = sizes[e]
            off = max((ends[e, 0] - along) / after[e, 0], (along - ends[e, 1]) / after[e, 1])
            y_u = 1 + outward[e, 0] * (u - at[e, 0]) / radius
            y_w = 1 + outward[e, 1] * (w - at[e, 1]) / radius
            if off >= 1 or y_u <= 0 or y_w <= 0:
                continue
            m = max(y_u, y_w)
            away = radius * max((y_u - 1) / beyond[e, 0], (y_w - 1) / beyond[e, 1])
            if away >= 1 or m <= inner:
                continue
            length = np.sqrt(y_u**2 + y_w**2) if norm == 2 else y_u + y_w
            share = min(1.0, 1 - off) * min(1.0, (1 - away) / (1 - EXTENT))
            if m < 1:
                share *= (1 - inner / m) / (1 - inner)
            step = share * radius * (m / length - 1)
            x[v, order[0]] += outward[e, 0] * step * y_u
            x[v, order[1]] += outward[e, 1] * step * y_w
