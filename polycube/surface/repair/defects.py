"""What is wrong with a surface, how many and where: numbers and places, without judgement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polycube.surface import measures as topology
from polycube.surface.intersections import self_intersections
from polycube.types import TriMesh

FLAT = 1e-12  # of the diagonal squared: a face no larger has no area
THIN = 0.02  # height over longest edge: about one degree at its sharpest corner


@dataclass(frozen=True, eq=False)
class Defect:
    """Places of one kind; a row of `items` is a vertex, an edge or a face."""

    problem: str
    items: np.ndarray  # (N, 1), (N, 2) or (N, 3) vertices
    note: str = ""


def find_defects(surface: TriMesh) -> list[Defect]:
    """Those that the surface, welded where corners are equal, has; in order of importance."""
    faces = surface.faces
    flat = _flat_faces(surface)
    found = [
        Defect("open edges", topology.open_edges(faces)),
        Defect("edges of more than two faces", topology.nonmanifold_edges(faces)),
        Defect("vertices where parts touch", topology.nonmanifold_vertices(faces)[:, None]),
        Defect("edges between faces of opposite sides", topology.misoriented_edges(faces)),
        _inside_out(surface),
        _pieces(surface),
        Defect("faces that intersect others", faces[np.unique(self_intersections(surface))]),
        Defect("faces given twice", faces[_repeated(faces)]),
        Defect("faces without area", faces[flat]),
        Defect("thin faces", faces[_thin_faces(surface) & ~flat], f"height below {THIN:g} of edge"),
    ]
    return [defect for defect in found if len(defect.items)]


def _inside_out(surface: TriMesh) -> Defect:
    inverted = topology.volume(surface) < 0
    return Defect(
        "faces of a surface that is inside out", surface.faces[: len(surface.faces) * inverted]
    )


def _pieces(surface: TriMesh) -> Defect:
    """The faces of all pieces but the largest."""
    piece = topology.components(surface.faces)
    spans = spans_of(surface, piece)
    return Defect(
        "faces of separate pieces", surface.faces[piece != spans.argmax()], f"{len(spans)} pieces"
    )


def spans_of(surface: TriMesh, piece: np.ndarray) -> np.ndarray:
    """(P,) diagonal of the box of each piece, whose number each face (F,) has."""
    low, high = np.full((piece.max() + 1, 3), np.inf), np.full((piece.max() + 1, 3), -np.inf)
    for corner in surface.faces.T:
        np.minimum.at(low, piece, surface.vertices[corner])
        np.maximum.at(high, piece, surface.vertices[corner])
    return np.linalg.norm(high - low, axis=1)


def _repeated(faces: np.ndarray) -> np.ndarray:
    """(F,) whether a face before has the same corners."""
    extra = np.ones(len(faces), dtype=bool)
    extra[np.unique(np.sort(faces, axis=1), axis=0, return_index=True)[1]] = False
    return extra


def _flat_faces(surface: TriMesh) -> np.ndarray:
    return topology.face_areas(surface) <= FLAT * topology.diagonal(surface) ** 2


def _thin_faces(surface: TriMesh) -> np.ndarray:
    corners = surface.vertices[surface.faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    return 2 * topology.face_areas(surface) < THIN * longest**2
