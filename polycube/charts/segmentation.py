"""Divide a surface along the edges of its polycube into one region per planar face (patch).

Corners and edges of the polycube are drawn on the surface at the positions of its parametrization,
along sharp edges if there are any, with the cyclic order of the polycube at every corner. The
topology of the regions is checked. The parametrization is only a guidance and may be rough.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from polycube.charts.mapped_surface import Sheet, Sides, refine, sides
from polycube.charts.tracing import Cost, Drawing, Sector, near
from polycube.errors import MeshingError
from polycube.structure.lattice import Boundary, boundary, cell_of_box
from polycube.surface.measures import diagonal, euler, face_areas, half_edges
from polycube.types import AXES, Labels, Parametrization, Polycube, TriMesh

WIDTHS = (0.1, 0.05, 0.2)  # widths of the guidance in cells, tried in sequence
SHUFFLES = 5  # number of other drawing orders, tried if short paths block the others
SHARP = 0.4  # cost of a path along a sharp edge, relative to other paths
FOREIGN = 3.0  # cost of a path in a region of other labels
# factor on the distance of a corner with 0, 1, 2, 3 sharp edges
CORNER = np.array([1.0, 0.8, 0.6, 0.3])


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


def network(surface: Boundary) -> Network:
    """The network of a manifold boundary."""
    left: dict[tuple[int, int], int] = {}  # patch of each directed edge
    turn: dict[tuple[int, int], tuple[int, int]] = {}  # next edge with the same start
    for patch, quad in zip(surface.patch.tolist(), surface.quads.tolist(), strict=True):
        for k, vertex in enumerate(quad):
            left[vertex, quad[(k + 1) % 4]] = patch
            turn[vertex, quad[(k + 1) % 4]] = vertex, quad[k - 1]
    leaving: dict[int, list[tuple[int, int]]] = {}
    for edge in sorted(e for e in left if left[e] != left[e[::-1]]):
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


@dataclass(frozen=True, eq=False)
class Segmentation:
    """A surface divided into the patches of a polycube."""

    drawing: Drawing  # a path for each arc of the network; the tags of the sheet are the patches
    polycube: Polycube
    outside: Boundary
    net: Network
    parent: np.ndarray  # (F,) face of the surface that contains each face of the sheet

    def labels(self, surface: TriMesh) -> Labels:
        """Labels of the faces of the surface, from the largest part of each."""
        sheet = self.drawing.sheet
        n_patches = self.outside.patch.max() + 1
        area = face_areas(TriMesh(sheet.vertices, sheet.faces))
        pair = self.parent * n_patches + sheet.tag
        shares = np.bincount(pair, area, len(surface.faces) * n_patches)
        patch = shares.reshape(-1, n_patches).argmax(axis=1)
        return Labels(self.outside.patch_axis[patch], patch)

    def describe(self, patch: int) -> str:
        """Describe a patch by number, direction and grid cell."""
        quad = int((self.outside.patch == patch).argmax())
        cell = cell_of_box(self.polycube)[self.outside.box[quad]]
        where = ", ".join(str(int(i)) for i in np.unravel_index(cell, self.polycube.grid))
        return f"polycube face {patch} ({AXES[self.outside.axis[quad]]}, cell ({where}))"


def segment(
    surface: TriMesh,
    polycube: Polycube,
    labels: Labels,
    parametrization: Parametrization,
    longest: float = 0.02,
) -> Segmentation:
    """The refined surface, in patches with the topology of those of the polycube.

    longest : largest edge of the refined surface, in diagonals

    Raises MeshingError for the first failure if no width of the guidance and no drawing order is
    successful.
    """
    outside = boundary(polycube)
    faces = np.arange(len(surface.faces))
    sheet = Sheet(surface.vertices, parametrization.positions, surface.faces, faces)
    sheet = refine(sheet, longest * diagonal(surface))
    net = network(outside)
    orders = [by_length(outside, net)] * len(WIDTHS)
    orders += [np.random.default_rng(seed).permutation(len(net.arcs)) for seed in range(SHUFFLES)]
    failures = []
    for order, width in zip(orders, (*WIDTHS, *WIDTHS[:1] * SHUFFLES), strict=True):
        found = Segmentation(Drawing(sheet, ()), polycube, outside, net, faces)
        try:
            found = _draw(found, labels, width, order)
            patch = _patches(found)
        except MeshingError as error:
            failures.append(error)
            continue
        drawn = found.drawing.sheet
        found.drawing.sheet = replace(drawn, tag=patch)
        return replace(found, parent=drawn.tag)
    raise failures[0]


def by_length(outside: Boundary, net: Network) -> np.ndarray:
    """The arcs in ascending length."""
    lengths = [np.ptp(outside.vertices[list(arc.vertices)], axis=0).sum() for arc in net.arcs]
    return np.argsort(lengths, kind="stable")


def _draw(empty: Segmentation, labels: Labels, width: float, order: np.ndarray) -> Segmentation:
    """Draw all arcs in the given order."""
    outside, net = empty.outside, empty.net
    corners = place_corners(empty.drawing.sheet, outside, net)
    drawing = Drawing(empty.drawing.sheet, corners.values())
    for number in order.tolist():
        arc = net.arcs[number]
        guide = near(outside.vertices[list(arc.vertices)], width)

        def cost(sheet: Sheet, sides: Sides, arc: Arc = arc, guide: Cost = guide) -> np.ndarray:
            is_adjacent = np.isin(labels.patch[sheet.tag], (arc.left, arc.right))
            factor = np.where(sides.sharp, SHARP, 1.0)
            factor *= np.where(sides.inside(is_adjacent), 1.0, FOREIGN)
            return guide(sheet, sides) * factor

        ends = corners[arc.vertices[0]], corners[arc.vertices[-1]]
        between = _sector(net, drawing, number, 0), _sector(net, drawing, number, -1)
        if not drawing.draw(number, ends, cost, between, 2 * len(arc.vertices)):
            edge = f"between {empty.describe(arc.left)} and {empty.describe(arc.right)}"
            what = f"the polycube does not fit the surface: the edge {edge} has no path on it"
            raise MeshingError(what)
    return replace(empty, drawing=drawing)


def place_corners(sheet: Sheet, outside: Boundary, net: Network) -> dict[int, int]:
    """Vertex of the sheet for each corner of the network: close by, preferably sharp."""
    found = sides(sheet)
    degree = np.bincount(found.ends[found.sharp].ravel(), minlength=len(sheet.vertices))
    corners = list(net.rings)
    gap = np.linalg.norm(sheet.places[:, None] - outside.vertices[corners], axis=2)  # (V, C)
    gap = (gap + 1e-3) * CORNER[np.minimum(degree, 3)][:, None]
    places: dict[int, int] = {}
    for k in np.argsort(gap.min(axis=0), kind="stable").tolist():
        gap[list(places.values()), k] = np.inf
        places[corners[k]] = int(gap[:, k].argmin())
    return places


def _sector(net: Network, drawing: Drawing, number: int, end: int) -> Sector:
    """Neighbours between which an arc must leave its corner, given the arcs drawn so far."""
    ring = net.rings[net.arcs[number].vertices[end]]
    at = ring.index((number, end))
    drawn = [s for s in (*ring[at + 1 :], *ring[:at]) if s[0] in drawing.paths]
    if not drawn:
        return None
    ends = ((drawing.paths[arc], side) for arc, side in (drawn[-1], drawn[0]))
    first, last = (int(path[1 if side == 0 else -2]) for path, side in ends)
    return first, last


def _patches(found: Segmentation) -> np.ndarray:
    """(F,) patch of each face; raises MeshingError if a region and its patch differ in topology."""
    faces, outside = found.drawing.sheet.faces, found.outside
    region = found.drawing.regions()
    half = {edge: i // 3 for i, edge in enumerate(map(tuple, half_edges(faces).tolist()))}
    owner: dict[int, int] = {}
    for arc, path in ((found.net.arcs[n], p.tolist()) for n, p in found.drawing.paths.items()):
        for a, b in pairwise(path):
            for patch, face in ((arc.left, half[a, b]), (arc.right, half[b, a])):
                if owner.setdefault(int(region[face]), patch) != patch:
                    raise _topology_error(found, patch, "overlaps another face")
    names = np.array([owner.get(r, -1) for r in range(region.max() + 1)])
    for patch in range(outside.patch.max() + 1):
        if (names == patch).sum() != 1:
            raise _topology_error(found, patch, f"has {(names == patch).sum()} regions")
        number = euler(faces[names[region] == patch])
        wanted = euler(outside.quads[outside.patch == patch])
        if number != wanted:
            raise _topology_error(found, patch, f"has Euler number {number}, not {wanted}")
    return names[region]


def _topology_error(found: Segmentation, patch: int, what: str) -> MeshingError:
    on_surface = f"{found.describe(patch)} {what}"
    return MeshingError(f"the polycube does not fit the surface: on it {on_surface}")
