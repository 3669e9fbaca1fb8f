"""Pieces of a surface with one label each: planes, parts of slanted planes, parts of bends.

Lengths are in diagonals of the bounding box, coordinates in a frame.
"""

from dataclasses import dataclass

import numpy as np

from polycube.structure.lattice import OUTWARD
from polycube.surface.edge_splits import cut, refined
from polycube.surface.measures import connected, face_areas, face_normals, twins
from polycube.types import TriMesh

FLAT = np.cos(np.radians(1))  # for two normals in one plane
BENT = np.cos(np.radians(3))  # for a normal and the mean normal of a plane
SMOOTH = np.cos(np.radians(35))  # for two facets of one bend
SMALL, LARGE = 1e-3, 0.06  # share of the area of a plane, and of one that may be a facet of a bend
SHARP = np.cos(np.radians(46))  # larger angles separate two bends
SLANTED = np.cos(np.radians(8))  # for the normal of a plane and the nearest axis


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
        for turn, direction in enumerate(_normal_directions(mean[number])):
            own = vertices[np.unique(faces[part == number])] @ direction
            middle = (own.min() + own.max()) / 2
            level = vertices @ direction - middle
            level[np.abs(level) < 0.2 * size] = 0
            vertices, faces, origin = cut(vertices, faces, part == number, level)
            part, side = part[origin], side[origin]
            is_above = vertices[faces].mean(axis=1) @ direction > middle
            side[part == number, turn] = np.where(is_above[part == number], 1, -1)
    fine = TriMesh(vertices, faces, part)
    nearest = np.where(is_plane[part], -1, (face_normals(fine) @ OUTWARD.T).argmax(axis=1))
    keys = np.column_stack([part, side, nearest])
    first, second = twins(faces)
    first, second = first // 3, second // 3
    same_piece = (keys[first] == keys[second]).all(axis=1)
    piece = connected(first[same_piece], second[same_piece], len(faces))
    _, where = np.unique(piece, return_index=True)
    areas = face_areas(fine)
    planar = float(areas[is_plane[part]].sum() / areas.sum())
    return Pieces(fine, piece, part[where], side[where], planar)


def _normal_directions(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors in a slanted plane: along the slope, and across it."""
    flat = np.eye(3)[np.abs(normal).argmin()]
    across = flat - flat @ normal * normal
    across /= np.linalg.norm(across)
    return np.cross(normal, across), across


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
    return total / np.maximum(np.linalg.norm(total, axis=1), 1e-30)[:, None]
