"""Pieces of a surface with one label each: planes, parts of slanted planes, parts of bends.

The borders of pieces are arcs between two of them, which are sorted around their ends. Lengths are
in diagonals of the bounding box, coordinates in a frame.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from polycube.structure.lattice import nearest_axis
from polycube.surface.edge_splits import cut, refined
from polycube.surface.measures import connected, face_areas, face_normals, half_edges, twins, unit
from polycube.types import TriMesh

FLAT = np.cos(np.radians(1))  # for two normals in one plane
BENT = np.cos(np.radians(3))  # for a normal and the mean normal of a plane
SMOOTH = np.cos(np.radians(35))  # for two facets of one bend
SMALL, LARGE = 1e-3, 0.06  # share of the area of a plane, and of one that may be a facet of a bend
SHARP = np.cos(np.radians(46))  # larger angles separate two bends
SLANTED = np.cos(np.radians(8))  # for the normal of a plane and the nearest axis
LEVEL = np.radians(0.5)  # angle between normals below which an arc is neither convex nor concave
CREASE = np.cos(np.radians(46))


@dataclass(frozen=True, eq=False)
class Pieces:
    """A refined surface in a frame, and the piece of each of its triangles."""

    surface: TriMesh  # in the frame, of diagonal 1; its regions are the faces of the part, from 0
    piece: np.ndarray  # (F,) from 0
    face: np.ndarray  # (P,) region of each piece
    side: np.ndarray  # (P, 2) side of a piece with respect to the two cuts of its face; 0 if uncut
    planar: float  # share of the area in planes

    @property
    def normals(self) -> np.ndarray:
        """(P, 3) unit mean normals."""
        return _mean(self.piece, face_normals(self.surface), face_areas(self.surface))


def pieces(surface: TriMesh, size: float) -> Pieces:
    """Pieces of a surface in its frame.

    A plane is one piece; a slanted plane is divided into four, along and across its slope. A bend
    is divided where its nearest axis changes.

    size : longest edge
    """
    part, is_plane = faces_of_part(surface)
    vertices, faces, origin = refined(surface.vertices, surface.faces, size)
    part = part[origin]
    fine = TriMesh(vertices, faces, part)
    side = np.zeros((len(faces), 2), int)
    mean = _mean(part, face_normals(fine), face_areas(fine))
    for number in np.flatnonzero(is_plane & (np.abs(mean).max(axis=1) < SLANTED)):
        flat = np.eye(3)[np.abs(mean[number]).argmin()]
        across = flat - flat @ mean[number] * mean[number]
        across /= np.linalg.norm(across)
        for turn, direction in enumerate((np.cross(mean[number], across), across)):
            own = vertices[np.unique(faces[part == number])] @ direction
            middle = (own.min() + own.max()) / 2
            level = vertices @ direction - middle
            level[np.abs(level) < 0.2 * size] = 0
            vertices, faces, origin = cut(vertices, faces, part == number, level)
            part, side = part[origin], side[origin]
            is_above = vertices[faces].mean(axis=1) @ direction > middle
            side[part == number, turn] = np.where(is_above[part == number], 1, -1)
    fine = TriMesh(vertices, faces, part)
    nearest = np.where(is_plane[part], -1, nearest_axis(face_normals(fine)))
    keys = np.column_stack([part, side, nearest])
    first, second = twins(faces)
    first, second = first // 3, second // 3
    same_piece = (keys[first] == keys[second]).all(axis=1)
    piece = connected(first[same_piece], second[same_piece], len(faces))
    _, where = np.unique(piece, return_index=True)
    areas = face_areas(fine)
    planar = float(areas[is_plane[part]].sum() / areas.sum())
    return Pieces(fine, piece, part[where], side[where], planar)


def faces_of_part(surface: TriMesh) -> tuple[np.ndarray, np.ndarray]:
    """Face of the part (F,) of each triangle, from 0, and which of them are planes.

    The faces are those of the CAD file if there are any. Otherwise the triangles of one plane are a
    face, and the others are connected across smooth edges.
    """
    normals, areas = face_normals(surface), face_areas(surface)
    first, second = twins(surface.faces)
    first, second = first // 3, second // 3
    cosine = np.einsum("ed,ed->e", normals[first], normals[second])
    if len(surface.region):
        same = surface.region[first] == surface.region[second]
    else:
        plane = connected(first[cosine > FLAT], second[cosine > FLAT], len(normals))
        share = np.bincount(plane, areas) / areas.sum()
        smooth = (plane[first] != plane[second]) & (cosine > SMOOTH)
        is_facet = np.isin(np.arange(len(share)), plane[np.append(first[smooth], second[smooth])])
        small = (share < SMALL) | (is_facet & (share < LARGE))
        small = (small | ~_planes(plane, normals, areas))[plane]
        same = (plane[first] == plane[second]) & ~small[first]
        same |= small[first] & small[second] & (cosine > SHARP)
    face = connected(first[same], second[same], len(normals))
    return face, _planes(face, normals, areas)


def _planes(face: np.ndarray, normals: np.ndarray, areas: np.ndarray) -> np.ndarray:
    """Whether the normals of each face are equal."""
    mean = _mean(face, normals, areas)
    low = np.ones(len(mean))
    np.minimum.at(low, face, np.einsum("fd,fd->f", normals, mean[face]))
    return low > BENT


def _mean(part: np.ndarray, normals: np.ndarray, areas: np.ndarray) -> np.ndarray:
    """(N, 3) unit mean normal of each part (F,) of triangles."""
    total = np.zeros((part.max() + 1, 3))
    np.add.at(total, part, normals * areas[:, None])
    return unit(total)


class Arcs(NamedTuple):
    """Arcs between pieces, numbered, and the fans of arcs around the end points of arcs.

    Side 0 of an arc is its first piece, side 1 its second. A fan lists the ends of arcs at one
    point, counter-clockwise; the sector of one piece is between an entry and the next.
    """

    pieces: np.ndarray  # (A, 2)
    length: np.ndarray  # (A,)
    turn: np.ndarray  # (A,) 1 convex, -1 concave, 0 in a plane
    cut: np.ndarray  # (A,) 2 face + 0 or 1 for the cut of a plane on which the arc lies, or -1
    is_crease: np.ndarray  # (A,) bool
    inside: np.ndarray  # (A,) mean angle of the solid
    start: np.ndarray  # (N + 1,) first entry of each fan
    arc: np.ndarray  # (M,) arc of each entry
    side: np.ndarray  # (M,) side of the sector after the entry, which gives its piece


def arcs(pieces: Pieces) -> Arcs:
    """Arcs and fans of pieces."""
    faces, piece = pieces.surface.faces, pieces.piece
    first, second = twins(faces)
    border = piece[first // 3] != piece[second // 3]
    first, second = first[border], second[border]
    swap = piece[first // 3] > piece[second // 3]
    first, second = np.where(swap, second, first), np.where(swap, first, second)
    ends = half_edges(faces)[first]
    count = np.bincount(ends.ravel(), minlength=len(pieces.surface.vertices))
    # of each border edge; edges are connected at points with exactly two of them
    point, edge = ends.ravel(), np.repeat(np.arange(len(ends)), 2)
    inner = count[point] == 2
    arc = connected(edge[inner], len(ends) + point[inner], len(ends) + len(count))[: len(ends)]
    number = int(arc.max(initial=-1)) + 1
    _, one = np.unique(arc, return_index=True)
    sides = np.stack([piece[first[one] // 3], piece[second[one] // 3]], axis=1)
    vector = np.diff(pieces.surface.vertices[ends], axis=1)[:, 0]
    size = np.linalg.norm(vector, axis=1)
    normals = face_normals(pieces.surface)
    left, right = normals[first // 3], normals[second // 3]
    sine = np.einsum("ed,ed->e", np.cross(left, right), vector / size[:, None])
    angle = np.arctan2(sine, np.einsum("ed,ed->e", left, right))
    length = np.bincount(arc, size, number)
    mean = np.bincount(arc, size * angle, number) / length
    turn = np.where(np.abs(mean) < LEVEL, 0, np.sign(mean)).astype(np.int64)
    bend = np.bincount(arc, size * np.cos(angle), number) / length
    half_arc = np.full(faces.size, -1)  # 2 arc + side of each half-edge between pieces
    half_arc[first], half_arc[second] = 2 * arc, 2 * arc + 1
    start, around = _fans(faces, half_arc, np.flatnonzero(count > 2))
    face, side = pieces.face[sides], pieces.side[sides]
    apart = side[:, 0] * side[:, 1] < 0
    is_cut = (face[:, 0] == face[:, 1]) & (apart.sum(axis=1) == 1)
    cuts = np.where(is_cut, 2 * face[:, 0] + apart.argmax(axis=1), -1)
    on_crease, inside = bend < CREASE, np.pi - mean
    return Arcs(sides, length, turn, cuts, on_crease, inside, start, around // 2, around % 2)


def _fans(
    faces: np.ndarray, half_arc: np.ndarray, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """First entry (N + 1,) of each point, and 2 arc + side of the border edges that start there."""
    first, second = twins(faces)
    other = np.empty(faces.size, np.int64)
    other[first], other[second] = second, first
    leaving = np.zeros(int(faces.max()) + 1, np.int64)
    leaving[faces.ravel()] = np.arange(faces.size)
    start, around = [0], []
    for point in points:
        here = begin = leaving[point]
        while True:
            if half_arc[here] >= 0:
                around.append(half_arc[here])
            here = other[here - here % 3 + (here + 2) % 3]  # the next edge, counter-clockwise
            if here == begin:
                break
        start.append(len(around))
    return np.array(start), np.array(around, np.int64)
