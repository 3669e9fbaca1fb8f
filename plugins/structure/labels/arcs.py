"""Borders of pieces: arcs between two pieces, and the order of arcs around their ends."""

from dataclasses import dataclass

import numpy as np

from polycube.surface.measures import connected, face_normals, half_edges, twins

from .pieces import Pieces

LEVEL = np.radians(0.5)  # angle between normals below which an arc is neither convex nor concave
CREASE = np.cos(np.radians(46))


@dataclass(frozen=True, eq=False)
class Arcs:
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
    arc = _chains(ends, count)
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
    return Arcs(
        sides,
        length,
        turn,
        _cuts(pieces, sides),
        bend < CREASE,
        np.pi - mean,
        start,
        around // 2,
        around % 2,
    )


def _chains(ends: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Arc (E,) of each border edge: edges connected at points with exactly two of them."""
    point, edge = ends.ravel(), np.repeat(np.arange(len(ends)), 2)
    order = np.argsort(point, kind="stable")
    point, edge = point[order], edge[order]
    joined = (point[1:] == point[:-1]) & (count[point[1:]] == 2)
    return connected(edge[:-1][joined], edge[1:][joined], len(ends))


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


def _cuts(pieces: Pieces, sides: np.ndarray) -> np.ndarray:
    """The cut of a plane to which each arc belongs, or -1."""
    face, side = pieces.face[sides], pieces.side[sides]
    apart = side[:, 0] * side[:, 1] < 0
    same = (face[:, 0] == face[:, 1]) & (apart.sum(axis=1) == 1)
    return np.where(same, 2 * face[:, 0] + apart.argmax(axis=1), -1)
