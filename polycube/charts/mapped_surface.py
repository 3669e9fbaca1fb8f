"""A surface with a position on the polycube for each vertex, which can be refined.

Refinement only splits edges: the shape is unchanged, and existing vertices keep their numbers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polycube.surface.measures import edges, face_normals
from polycube.types import TriMesh, freeze

TURN = np.cos(np.pi / 4)  # for the normals at a sharp edge


@dataclass(frozen=True, eq=False)
class Sheet:
    """Closed triangle surface and its positions on the polycube."""

    vertices: np.ndarray  # (V, 3) in model units
    places: np.ndarray  # (V, 3) on the polycube, cell edge 1
    faces: np.ndarray  # (F, 3) indices of vertices
    tag: np.ndarray  # (F,) a number that a face passes to its parts

    def __post_init__(self) -> None:
        freeze(
            self,
            vertices=("V 3", np.float64),
            places=("V 3", np.float64),
            faces=("F 3", np.int64),
            tag=("F", np.int64),
        )


@dataclass(frozen=True, eq=False)
class Sides:
    """The edges of a sheet."""

    ends: np.ndarray  # (E, 2) vertices, ascending
    of_face: np.ndarray  # (F, 3) edge from each corner to the next
    length: np.ndarray  # (E,)
    sharp: np.ndarray  # (E,) whether the normals turn by more than 45 degrees

    def inside(self, faces: np.ndarray) -> np.ndarray:
        """(E,) whether an edge is one of a face in the mask (F,)."""
        found = np.zeros(len(self.ends), bool)
        found[self.of_face[faces]] = True
        return found


def sides(sheet: Sheet) -> Sides:
    """The edges of a sheet."""
    ends, _, edge = edges(sheet.faces)
    first, second = np.argsort(edge, kind="stable").reshape(-1, 2).T // 3  # faces of each edge
    normals = face_normals(TriMesh(sheet.vertices, sheet.faces))
    real = np.any(normals, axis=1)
    turns = np.einsum("nd,nd->n", normals[first], normals[second]) < TURN
    sharp = turns & real[first] & real[second]
    length = np.linalg.norm(np.diff(sheet.vertices[ends], axis=1)[:, 0], axis=1)
    return Sides(ends, edge.reshape(-1, 3), length, sharp)


def split(sheet: Sheet, sides: Sides, marked: np.ndarray) -> Sheet:
    """Halve the marked sides (E,) of a sheet.

    The midpoint of the n-th marked edge becomes the n-th new vertex.
    """
    ends = sides.ends
    number = np.where(marked, len(sheet.vertices) + np.cumsum(marked) - 1, -1)
    middle = number[sides.of_face]  # of the half-edges 0-1, 1-2, 2-0
    n_marked = (middle >= 0).sum(axis=1)
    # rotate each face so that a single mark is on its first side, a single unmarked one on its last
    first = np.where(n_marked == 1, (middle >= 0).argmax(axis=1), (middle < 0).argmax(axis=1) + 1)
    turn = (np.where(n_marked % 3 == 0, 0, first)[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(sheet.faces, turn, axis=1).T
    ab, bc, ca = np.take_along_axis(middle, turn, axis=1).T
    points = np.vstack([sheet.vertices, sheet.vertices[ends[marked]].mean(axis=1)])
    across = np.linalg.norm(points[ab] - points[c], axis=1)
    short = across < np.linalg.norm(points[a] - points[bc], axis=1)
    one, two, all_ = n_marked == 1, n_marked == 2, n_marked == 3
    pieces = [
        (n_marked == 0, (a, b, c)),
        (one, (a, ab, c)),
        (one, (ab, b, c)),
        (two, (ab, b, bc)),
        (two & short, (a, ab, c)),
        (two & short, (ab, bc, c)),
        (two & ~short, (a, ab, bc)),
        (two & ~short, (a, bc, c)),
        (all_, (a, ab, ca)),
        (all_, (ab, b, bc)),
        (all_, (ca, bc, c)),
        (all_, (ab, bc, ca)),
    ]
    faces = np.concatenate([np.stack(corners, axis=1)[where] for where, corners in pieces])
    tag = np.concatenate([sheet.tag[where] for where, _ in pieces])
    places = np.vstack([sheet.places, sheet.places[ends[marked]].mean(axis=1)])
    return Sheet(points, places, faces, tag)


def refine(sheet: Sheet, longest: float) -> Sheet:
    """Refine a sheet until no edge is longer than a length in model units."""
    while True:
        found = sides(sheet)
        if not (found.length > longest).any():
            return sheet
        sheet = split(sheet, found, found.length > longest)
