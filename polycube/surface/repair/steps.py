"""Defects of a surface, and the steps of a repair, which return the new surface and the changes."""

from dataclasses import dataclass

import numpy as np

from polycube.surface import measures as topology
from polycube.surface.intersections import self_intersections
from polycube.surface.measures import diagonal, place, volume
from polycube.surface.repair import clean
from polycube.surface.repair.clean import are_flat, are_repeated
from polycube.surface.repair.holes import MAX_LOOP, filling, flatness, loops, nested
from polycube.surface.voxels import winding_numbers
from polycube.types import TriMesh

THIN = 0.02  # height over longest edge: about one degree at the sharpest corner
FLAT_HOLE = 1e-3  # of its diagonal: a hole with a smaller deviation from its plane counts as flat
DEBRIS = 0.01  # of the diagonal of the largest component: smaller components are removed


@dataclass(frozen=True, eq=False)
class Defect:
    """Defects of one kind; a row of `items` is a vertex, an edge or a face."""

    problem: str
    items: np.ndarray  # (N, 1), (N, 2) or (N, 3) vertices
    note: str = ""


def find_defects(surface: TriMesh) -> list[Defect]:
    """Defects of a surface after welding equal corners, in order of importance."""
    faces, flat = surface.faces, are_flat(surface)
    corners = surface.vertices[faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    is_thin = 2 * topology.face_areas(surface) < THIN * longest**2
    inverted = faces if volume(surface) < 0 else faces[:0]
    piece = topology.components(faces)
    spans = spans_of(surface, piece)
    found = [
        Defect("open edges", topology.open_edges(faces)),
        Defect("edges of more than two faces", topology.nonmanifold_edges(faces)),
        Defect("vertices where parts touch", topology.nonmanifold_vertices(faces)[:, None]),
        Defect("edges between faces of opposite sides", topology.misoriented_edges(faces)),
        Defect("faces of a surface that is inside out", inverted),
        Defect("faces of separate pieces", faces[piece != spans.argmax()], f"{len(spans)} pieces"),
        Defect("faces that intersect others", faces[np.unique(self_intersections(surface))]),
        Defect("faces given twice", faces[are_repeated(faces)]),
        Defect("faces without area", faces[flat]),
        Defect("thin faces", faces[is_thin & ~flat], f"height below {THIN:g} of edge"),
    ]
    return [defect for defect in found if len(defect.items)]


def spans_of(surface: TriMesh, piece: np.ndarray) -> np.ndarray:
    """(P,) diagonal of the bounding box of each component; `piece` (F,) is that of each face."""
    low, high = np.full((piece.max() + 1, 3), np.inf), np.full((piece.max() + 1, 3), -np.inf)
    corners = surface.vertices[surface.faces]
    np.minimum.at(low, piece, corners.min(axis=1))
    np.maximum.at(high, piece, corners.max(axis=1))
    return np.linalg.norm(high - low, axis=1)


def weld_near(surface: TriMesh) -> clean.Step:
    """Merge vertices that nearly coincide, unless the surface is closed."""
    return (surface, []) if topology.is_closed(surface.faces) else clean.weld_near(surface)


def drop_fins(surface: TriMesh) -> clean.Step:
    """Remove faces that have an open edge and an edge with more than two faces."""
    faces, remains = surface.faces, np.ones(len(surface.faces), dtype=bool)
    while True:
        _, count, edge = topology.edges(faces[remains])
        on = count[edge].reshape(-1, 3)
        fin = (on == 1).any(axis=1) & (on > 2).any(axis=1)
        if not fin.any():
            break
        remains[np.flatnonzero(remains)[fin]] = False
    return clean.without(surface, ~remains, "that are attached to only one edge")


def drop_debris(surface: TriMesh) -> clean.Step:
    """Remove components that are tiny compared with the largest one."""
    piece = topology.components(surface.faces)
    spans = spans_of(surface, piece)
    return clean.without(surface, (spans < DEBRIS * spans.max())[piece], "of debris")


def part_touching(surface: TriMesh) -> clean.Step:
    """Give each fan of faces around a vertex its own vertex at the same position."""
    if not topology.is_closed(surface.faces):
        return surface, []
    touching = topology.nonmanifold_vertices(surface.faces)
    if not len(touching):
        return surface, []
    fan = topology.fans(surface.faces)
    _, first, corner = np.unique(fan, return_index=True, return_inverse=True)
    where = place(surface, surface.vertices[touching[0]])
    note = f"split vertices where surfaces touch: {len(touching)}, the first at {where}"
    return TriMesh(surface.vertices[surface.faces.ravel()[first]], corner.reshape(-1, 3)), [note]


def orient(surface: TriMesh) -> clean.Step:
    """Orient the faces consistently if every edge has at most two faces."""
    if len(topology.nonmanifold_edges(surface.faces)):
        return surface, []
    return clean.orient(surface)


def close_holes(surface: TriMesh, widest_closed: float) -> clean.Step:
    """Close holes that are flat, or narrower than a share of the diagonal."""
    faces = surface.faces
    if not len(topology.open_edges(faces)) or len(topology.nonmanifold_edges(faces)):
        return surface, []
    found = loops(faces)
    alone, size = ~nested(surface, found), diagonal(surface)
    patches, edges, widest = [], 0, 0.0
    for loop, is_alone in zip(found, alone, strict=True):
        points = surface.vertices[loop]
        width = float(np.linalg.norm(np.ptp(points, axis=0)))
        small = width <= widest_closed * size
        flat = len(loop) > 3 and flatness(points) <= FLAT_HOLE
        if 3 <= len(loop) <= MAX_LOOP and (small or len(loop) == 3 or (flat and is_alone)):
            patches.append(loop[filling(points)])
            edges, widest = edges + len(loop), max(widest, width)
    if not patches:
        return surface, []
    closed = TriMesh(surface.vertices, np.concatenate([faces, *patches]))
    added = len(closed.faces) - len(faces)
    return closed, [
        f"closed holes: {len(patches)} of {len(found)}, {edges} edges, {added} new faces, "
        f"the widest {100 * widest / size:.2g} % of the diagonal"
    ]


def fill_voids(surface: TriMesh, largest: float) -> clean.Step:
    """Remove components inside the largest one."""
    piece = topology.components(surface.faces)
    spans = spans_of(surface, piece)
    if len(spans) == 1 or not topology.is_closed(surface.faces):
        return surface, []
    shells = [TriMesh(surface.vertices, surface.faces[piece == p]) for p in range(len(spans))]
    outer = shells[int(spans.argmax())]
    if volume(outer) == 0:
        return surface, []
    gone, sizes = np.zeros(len(spans), dtype=bool), []
    for p, shell in enumerate(shells):
        size = abs(volume(shell) / volume(outer))
        probes = surface.vertices[np.unique(shell.faces)]
        if shell is not outer and size <= largest:
            gone[p] = (np.abs(winding_numbers(outer, probes)) > 0.5).all()
            sizes += [size] * int(gone[p])
    left, notes = clean.without(surface, gone[piece], "of inner voids")
    share = 100 * sum(sizes)
    return left, [f"{note}; {len(sizes)} filled, {share:.2g} % of the volume" for note in notes]


def outward(surface: TriMesh) -> TriMesh:
    """Orient each component outwards."""
    piece = topology.components(surface.faces)
    faces = surface.faces.copy()
    for p in range(piece.max() + 1):
        own = piece == p
        if volume(TriMesh(surface.vertices, faces[own])) < 0:
            faces[own] = faces[own][:, ::-1]
    return TriMesh(surface.vertices, faces)
