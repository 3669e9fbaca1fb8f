"""Creases of a mesh of a CAD part: its edges on curves at which the CAD faces turn.

The angle is that between the CAD faces, not between the quads: a coarse cylinder has no creases,
and a flat chamfer has all of its creases.
"""

import numpy as np
from scipy.spatial import cKDTree

from polycube.hexmesh.connectivity import quad_edges
from polycube.hexmesh.named_sets import cad_faces
from polycube.surface.fit_target import target
from polycube.types import HexMesh, TriMesh


def cad_creases(mesh: HexMesh, surface: TriMesh, angle: float) -> np.ndarray:
    """Find the boundary edges between two CAD faces that turn by more than an angle there.

    Parameters
    ----------
    mesh : hex mesh with the sets of its CAD faces
    surface : surface with its CAD faces as `region`
    angle : in radians

    Returns
    -------
    (S, 2) vertices, ascending
    """
    goal, face = target(surface), cad_faces(mesh)
    edges, quads = quad_edges(mesh.quads)
    adjacent = np.sort(face[quads], axis=1)
    middle = goal.to_unit(mesh.vertices)[edges].mean(axis=1)
    nearest, turn = np.full(len(edges), np.inf), np.zeros(len(edges))
    for crease in goal.followed.creases:
        own = np.flatnonzero(
            (adjacent == crease.faces).all(axis=1) & (adjacent[:, 0] != adjacent[:, 1])
        )
        arc, off = crease.nearest(middle[own])
        own, arc, off = (part[off < nearest[own]] for part in (own, arc, off))
        nearest[own], turn[own] = off, abs(np.pi - crease.at(arc)[2])
    return edges[turn > angle]


def cad_corners(mesh: HexMesh, surface: TriMesh) -> np.ndarray:
    """(P,) boundary vertices of a mesh that are closest to the ends of the curves of its part."""
    goal, outside = target(surface), np.unique(mesh.quads)
    corners = goal.followed.corners
    if not len(corners):
        return outside[:0]
    tree = cKDTree(goal.to_unit(mesh.vertices[outside]))
    return np.unique(outside[tree.query(corners)[1]])
