"""Defects of a surface: kinds, numbers and places."""

from dataclasses import dataclass

import numpy as np

from polycube.surface import measures as topology
from polycube.surface.intersections import self_intersections
from polycube.surface.repair.clean import are_flat, are_repeated
from polycube.types import TriMesh

THIN = 0.02  # height over longest edge: about one degree at the sharpest corner


@dataclass(frozen=True, eq=False)
class Defect:
    """Defects of one kind; a row of `items` is a vertex, an edge or a face."""

    problem: str
    items: np.ndarray  # (N, 1), (N, 2) or (N, 3) vertices
    note: str = ""


def find_defects(surface: TriMesh) -> list[Defect]:
    """Defects of a surface after welding equal corners, in order of importance."""
    faces = surface.faces
    flat = are_flat(surface)
    found = [
        Defect("open edges", topology.open_edges(faces)),
        Defect("edges of more than two faces", topology.nonmanifold_edges(faces)),
        Defect("vertices where parts touch", topology.nonmanifold_vertices(faces)[:, None]),
        Defect("edges between faces of opposite sides", topology.misoriented_edges(faces)),
        _inside_out(surface),
        _pieces(surface),
        Defect("faces that intersect others", faces[np.unique(self_intersections(surface))]),
        Defect("faces given twice", faces[are_repeated(faces)]),
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
    """The faces of all components except the largest."""
    piece = topology.components(surface.faces)
    spans = spans_of(surface, piece)
    return Defect(
        "faces of separate pieces", surface.faces[piece != spans.argmax()], f"{len(spans)} pieces"
    )


def spans_of(surface: TriMesh, piece: np.ndarray) -> np.ndarray:
    """(P,) diagonal of the bounding box of each component; `piece` (F,) is that of each face."""
    low, high = np.full((piece.max() + 1, 3), np.inf), np.full((piece.max() + 1, 3), -np.inf)
    for corner in surface.faces.T:
        np.minimum.at(low, piece, surface.vertices[corner])
        np.maximum.at(high, piece, surface.vertices[corner])
    return np.linalg.norm(high - low, axis=1)


def _thin_faces(surface: TriMesh) -> np.ndarray:
    corners = surface.vertices[surface.faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    return 2 * topology.face_areas(surface) < THIN * longest**2
