"""Hexes of a part whose leaning faces were set upright, moved back to the part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from polycube.hexmesh.background.background import NoBackgroundError
from polycube.hexmesh.connectivity import edges, genus, quad_edges
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.numerics.harmonic import harmonic
from polycube.surface import closest, measures
from polycube.surface.measures import diagonal, half_edges, twins
from polycube.types import HexMesh, TriMesh

from .upright import Upright

INVERTED = 0.02  # largest share of inverted hexes, which the fit can still unfold
ON = 1e-3  # of the diagonal: distance within which a vertex is on a face or curve


def moved_back(mesh: HexMesh, straight: Upright, surface: TriMesh) -> HexMesh:
    """Hexes of a changed surface, moved to the original one.

    Vertices at changed faces move with these, those on other curves not at all, and the rest
    harmonically, first on the boundary.

    Raises
    ------
    NoBackgroundError
        If the topology is wrong, or if many hexes are inverted.
    """
    x, outer = mesh.vertices, np.unique(mesh.quads)
    places, faces = straight.surface.vertices, surface.faces[straight.is_changed]
    shift = (surface.vertices - places)[faces]
    at, face, weight = closest.closest(closest.tree(places[faces]), x[outer])
    near = ON * diagonal(surface)
    on_face = np.linalg.norm(at - x[outer], axis=1) < near
    one, two = twins(surface.faces)
    is_curve = surface.region[one // 3] != surface.region[two // 3]
    a, b = np.moveaxis(places[half_edges(surface.faces)[one[is_curve]]], 1, 0)
    on_curve = closest.distance(closest.tree(np.stack([a, b, b], axis=1)), x[outer]) < near
    found = np.zeros_like(x)
    moved = np.einsum("nk,nkd->nd", weight, shift[face])
    found[outer[on_face]] = moved[on_face]
    found = harmonic(x, quad_edges(mesh.quads)[0], outer[~(on_face | on_curve)], found)
    vertices = x + harmonic(x, edges(mesh.hexes), np.setdiff1d(np.arange(len(x)), outer), found)
    is_inverted = scaled_jacobian(vertices, mesh.hexes) < 0
    if genus(mesh) != measures.genus(surface) or is_inverted.mean() > INVERTED:
        raise NoBackgroundError("its leaning faces do not fit on a stack")
    return replace(mesh, vertices=vertices)
