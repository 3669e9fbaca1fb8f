"""A surface with a position on the polycube for each vertex, which can be refined.

Refinement only splits edges: the shape is unchanged, and existing vertices keep their numbers.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from polycube.surface import edge_splits
from polycube.surface.measures import edges, face_normals
from polycube.types import TriMesh
from polycube.types.checks import Arrays

TURN = np.cos(np.pi / 4)  # for the normals at a sharp edge


@dataclass(frozen=True, eq=False)
class Sheet(Arrays):
    """Closed triangle surface and its positions on the polycube."""

    vertices: Annotated[np.ndarray, "V 3"]  # in model units
    places: Annotated[np.ndarray, "V 3"]  # on the polycube, cell edge 1
    faces: Annotated[np.ndarray, "F 3 int"]  # indices of vertices
    tag: Annotated[np.ndarray, "F int"]  # a number that a face passes to its parts


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
    share = np.where(marked, 0.5, np.nan)
    vertices, faces, parent = edge_splits.split(sheet.vertices, sheet.faces, share)
    places = np.vstack([sheet.places, sheet.places[sides.ends[marked]].mean(axis=1)])
    return Sheet(vertices, places, faces, sheet.tag[parent])


def refine(sheet: Sheet, longest: float) -> Sheet:
    """Refine a sheet until no edge is longer than a length in model units."""
    while True:
        found = sides(sheet)
        if not (found.length > longest).any():
            return sheet
        sheet = split(sheet, found, found.length > longest)
