"""The smooth surface of which the triangles of a curved CAD face are chords.

The vertices are on the CAD face. The normal at a vertex follows from the quadratic height field of
least squares through the vertices of two rings of triangles (Cazals and Pouget 2005). The smooth
surface has half of the offsets of Phong tessellation (Boubekeur and Alexa 2008), which is exact for
quadratic surfaces, up to terms of fourth order in the size of the triangles.
"""

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.sparse import csr_matrix

from polycube.surface.curves.features import Crease
from polycube.surface.measures import area_vectors, connected, curved_faces, frame, twins, unit
from polycube.types import TriMesh

RIDGE = 1e-6  # relative regularization, for curvatures that the vertices do not determine
STEEP = np.radians(20)  # angle from a triangle above which its normal is used: at an apex
KINK = np.radians(40)  # angle between two triangles that are not on one smooth surface
NEAREST = 0.1  # squared distance, in mean ones, below which the weight of a vertex does not grow
PIECES = 4  # pieces of each edge of a smooth curve


def corner_normals(surface: TriMesh, normals: np.ndarray) -> np.ndarray:
    """(F, 3, 3) unit normals of the smooth surface at the corners of each triangle.

    On planes and without CAD faces, these are the given normals (F, 3) of the triangles.
    """
    found = np.repeat(normals[:, None], 3, axis=1)
    if not len(surface.region) or not (is_curved := curved_faces(surface)[surface.region]).any():
        return found
    own = np.flatnonzero(is_curved)
    one, two = twins(surface.faces[own])
    is_smooth = np.einsum("nd,nd->n", *normals[own[np.stack([one, two]) // 3]]) > np.cos(KINK)
    patch = connected(one[is_smooth] // 3, two[is_smooth] // 3, len(own))
    corners = np.stack([surface.faces[own], np.tile(patch[:, None], 3)], axis=2)
    places, at = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    size = len(places)
    share = csr_matrix((np.ones(at.size), (at.ravel(), np.arange(at.size) // 3)), (size, len(own)))
    ring = share @ share.T
    row, col = (ring @ ring).nonzero()
    row, col = row[row != col], col[row != col]
    x = surface.vertices[places[:, 0]]
    axes = frame(unit(share @ area_vectors(surface)[own]))
    step = np.einsum("nij,nj->ni", axes[row], x[col] - x[row])
    square = (step**2).sum(axis=1)
    scale = np.sqrt(np.bincount(row, square, size) / np.bincount(row, minlength=size))[row]
    u, v, height = step.T / scale
    terms = np.stack([u, v, u * u / 2, u * v, v * v / 2, height], axis=1)
    products = (terms[:, :, None] * terms[:, None]).reshape(-1, 36)
    near = 1 / (NEAREST + square / scale**2)
    weight = csr_matrix((near, (row, np.arange(len(row)))), (size, len(row)))
    sums = np.asarray(weight @ products).reshape(size, 6, 6)[:, :5]
    ridge = RIDGE * np.trace(sums, axis1=1, axis2=2)[:, None, None] * np.eye(5)
    slope = np.linalg.solve(sums[..., :5] + ridge, sums[..., 5:])[:, :2, 0]
    smooth = unit(np.einsum("nij,ni->nj", axes, np.column_stack([-slope, np.ones(size)])))
    smooth = smooth[at].reshape(-1, 3, 3)
    is_near = np.einsum("fkd,fd->fk", smooth, normals[own]) > np.cos(STEEP)
    found[own] = np.where(is_near[..., None], smooth, found[own])
    return found


def lifted(
    points: np.ndarray, corners: np.ndarray, normals: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Points and unit normals (N, 3) of the smooth surface for points (N, 3) of triangles.

    corners, normals : (N, 3, 3) corners of the triangles, and normals of the smooth surface there
    """
    a, b, c = np.moveaxis(corners, 1, 0)
    area = np.cross(b - a, c - a)
    square = np.maximum((area**2).sum(axis=1), 1e-300)
    second = (np.cross(points - a, c - a) * area).sum(axis=1) / square
    third = (np.cross(b - a, points - a) * area).sum(axis=1) / square
    share = np.stack([1 - second - third, second, third], axis=1)
    below = ((corners - points[:, None]) * normals).sum(axis=2)
    shift = np.einsum("nk,nkd->nd", share * below, normals) / 2
    return points + shift, unit(np.einsum("nk,nkd->nd", share, normals))


def smooth_curve(crease: Crease) -> np.ndarray:
    """(N, 3) points of a smooth curve through the points of a crease, which are among them."""
    arc, points = crease.arc, crease.points
    number = len(arc) - 1
    at = np.interp(np.arange(PIECES * number + 1) / PIECES, np.arange(number + 1), arc)
    if crease.is_loop:
        around = np.arange(-3, number + 4)
        arc = arc[around % number] + crease.length * (around // number)
        points = points[around % number]
    chord = np.diff(points, axis=0) / np.diff(arc)[:, None]
    if len(chord) == 1:
        return points[0] + (at - arc[0])[:, None] * chord
    # central differences: unlike those of a parabola, they do not depend on very short edges
    inner = (points[2:] - points[:-2]) / (arc[2:] - arc[:-2])[:, None]
    ends = 2 * chord[[0, -1]] - inner[[0, -1]]
    slope = np.concatenate([ends[:1], inner, ends[1:]])
    return np.asarray(CubicHermiteSpline(arc, points, slope)(at))
