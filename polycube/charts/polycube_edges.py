"""The edges of a polycube as a network: corners, straight arcs between them, and their order.

An arc separates two planar faces (patches) and connects two corners; a corner is a vertex with more
than two arcs. Seen from outside, the arcs at a corner have a cyclic order.
"""

from dataclasses import dataclass

from polycube.structure.lattice import Boundary


@dataclass(frozen=True)
class Arc:
    """A straight edge of the polycube between two corners."""

    vertices: tuple[int, ...]  # boundary vertices from corner to corner
    left: int  # patch on the left, seen from outside
    right: int


@dataclass(frozen=True)
class Network:
    """Arcs of the boundary of a polycube, and the arcs at each corner."""

    arcs: tuple[Arc, ...]
    # for each corner the (arc, 0 at its start or -1 at its end), counter-clockwise from outside
    rings: dict[int, tuple[tuple[int, int], ...]]
    # end), counter-clockwise from outside


def network(surface: Boundary) -> Network:
    """The network of a manifold boundary."""
    left: dict[tuple[int, int], int] = {}  # patch of each directed edge
    turn: dict[tuple[int, int], tuple[int, int]] = {}  # next edge with the same start
    for patch, quad in zip(surface.patch.tolist(), surface.quads.tolist(), strict=True):
        for k, vertex in enumerate(quad):
            left[vertex, quad[(k + 1) % 4]] = patch
            turn[vertex, quad[(k + 1) % 4]] = vertex, quad[k - 1]
    between = sorted(e for e in left if left[e] != left[e[::-1]])
    leaving: dict[int, list[tuple[int, int]]] = {}
    for edge in between:
        leaving.setdefault(edge[0], []).append(edge)
    arcs: list[Arc] = []
    seen: set[tuple[int, int]] = set()
    at: dict[tuple[int, int], tuple[int, int]] = {}  # arc and its end, for each first edge
    for corner in (v for v, out in leaving.items() if len(out) > 2):
        for edge in leaving[corner]:
            if edge in seen:
                continue
            walk = [*edge]
            while len(leaving[walk[-1]]) == 2:
                walk += [w for _, w in leaving[walk[-1]] if w != walk[-2]]
            at[walk[0], walk[1]], at[walk[-1], walk[-2]] = (len(arcs), 0), (len(arcs), -1)
            seen |= {edge, (walk[-1], walk[-2])}
            arcs.append(Arc(tuple(walk), left[edge], left[edge[::-1]]))
    return Network(tuple(arcs), {v: _ring(v, at, turn) for v in leaving if len(leaving[v]) > 2})


def _ring(
    corner: int,
    at: dict[tuple[int, int], tuple[int, int]],
    turn: dict[tuple[int, int], tuple[int, int]],
) -> tuple[tuple[int, int], ...]:
    """Arcs that leave a corner, counter-clockwise from outside."""
    first = edge = next(e for e in at if e[0] == corner)
    ring = []
    while True:
        if edge in at:
            ring.append(at[edge])
        edge = turn[edge]
        if edge == first:
            return tuple(ring)
