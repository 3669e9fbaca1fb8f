"""Planes, corners and reflex edges of a surface with planar faces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polycube.surface.measures import (
    components,
    connected,
    diagonal,
    face_areas,
    face_normals,
    genus,
    half_edges,
    twins,
)
from polycube.types import TriMesh

FLAT = np.radians(0.01)  # largest angle between the normals of triangles in one plane
NEAR = 1e-5  # of the diagonal: largest distance of the points of a face from its plane
THIRD = 1e-6  # smallest singular value of the normals at a corner


class NotPolyhedralError(Exception):
    """The surface is not a polyhedron with few planes; the message is a clause with the reason."""


@dataclass(frozen=True, eq=False)
class Polyhedron:
    """A solid with planar faces.

    Parameters
    ----------
    surface : its triangles
    face : (F,) number of the planar face of each triangle
    corners : (C, 3)
    edges : (E, 2, 3) ends of the edges of triangles between two faces
    reflex : (R, 2, 3) a point and the normal of the plane that bisects the angle of the solid at
        each edge of more than 180 degrees
    """

    surface: TriMesh
    face: np.ndarray
    corners: np.ndarray
    edges: np.ndarray
    reflex: np.ndarray


def polyhedron(surface: TriMesh, most: int) -> Polyhedron:
    """The polyhedron of a closed surface.

    Its faces are those of the CAD file, or the connected coplanar sets of triangles.

    Parameters
    ----------
    surface : closed surface
    most : largest number of corners

    Raises
    ------
    NotPolyhedralError
        If the surface has handles or several shells, if a face is not planar, if two adjacent CAD
        faces are coplanar, or if there are more corners.
    """
    if components(surface.faces).any() or genus(surface) != 0:
        raise NotPolyhedralError("the part has holes or voids")
    sides, others = twins(surface.faces)
    first, second = sides // 3, others // 3
    by_triangle = face_normals(surface)
    turn = _angle(by_triangle[first], by_triangle[second])
    is_smooth = turn < FLAT
    if len(surface.region):
        same = surface.region[first] == surface.region[second]
        if (same & ~is_smooth).any():
            where = surface.region[first[np.argmax(same & ~is_smooth)]]
            raise NotPolyhedralError(f"face {where} is not planar")
        if (~same & is_smooth).any():
            where = surface.region[first[np.argmax(~same & is_smooth)]]
            raise NotPolyhedralError(f"face {where} is in one plane with an adjacent face")
    plane = connected(first[is_smooth], second[is_smooth], len(surface.faces))
    normals = np.zeros((plane.max() + 1, 3))
    np.add.at(normals, plane, by_triangle * face_areas(surface)[:, None])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    _check_flat(surface, plane, normals)
    corners = _corners(surface, plane, normals, most)
    edges = surface.vertices[half_edges(surface.faces)[sides[~is_smooth]]]
    one, other = normals[plane[first[~is_smooth]]], normals[plane[second[~is_smooth]]]
    along = edges[:, 1] - edges[:, 0]
    is_reflex = np.einsum("ed,ed->e", np.cross(one, other), along) < 0
    across = (one - other)[is_reflex]
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    reflex = np.stack([edges[is_reflex, 0], across], axis=1)
    return Polyhedron(surface, plane, corners, edges, reflex)


def _corners(surface: TriMesh, plane: np.ndarray, normals: np.ndarray, most: int) -> np.ndarray:
    """(C, 3) vertices at which the normals of the planes span all directions."""
    touching = np.unique(np.stack([surface.faces.ravel(), np.repeat(plane, 3)], axis=1), axis=0)
    by_plane = normals[touching[:, 1]]
    spread = np.zeros((len(surface.vertices), 3, 3))
    np.add.at(spread, touching[:, 0], by_plane[:, :, None] * by_plane[:, None, :])
    at = np.linalg.eigvalsh(spread)[:, 0] > THIRD**2
    if at.sum() > most:
        raise NotPolyhedralError(f"there are {at.sum()} corners, more than {most}")
    return surface.vertices[at]


def _check_flat(surface: TriMesh, plane: np.ndarray, normals: np.ndarray) -> None:
    height = np.einsum("fkd,fd->fk", surface.vertices[surface.faces], normals[plane])
    low, high = np.full(len(normals), np.inf), np.full(len(normals), -np.inf)
    np.minimum.at(low, plane, height.min(axis=1))
    np.maximum.at(high, plane, height.max(axis=1))
    if (high - low).max() > NEAR * diagonal(surface):
        raise NotPolyhedralError("a face is not planar")


def _angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(N,) angles between unit vectors (N, 3)."""
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("nd,nd->n", a, b))
