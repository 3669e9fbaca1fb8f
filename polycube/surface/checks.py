"""Checks that a surface is the boundary of one solid; messages give the defect and its place."""

import numpy as np

from polycube.errors import InputError
from polycube.surface import measures
from polycube.surface.voxels import winding_numbers
from polycube.types import TriMesh

FLAT = 1e-9  # volume / (area * diagonal), below which a surface is taken to enclose no volume


def check_closed(surface: TriMesh) -> None:
    """Raise InputError unless every edge has exactly two faces."""
    faces = surface.faces
    _refuse(surface, measures.nonmanifold_edges(faces), "not manifold", "with more than two faces")
    _refuse(surface, measures.open_edges(faces), "not closed", "with one face only")


def check_surface(surface: TriMesh) -> None:
    """Raise InputError unless the surface bounds one solid."""
    faces = surface.faces
    check_closed(surface)
    edges = measures.misoriented_edges(faces)
    _refuse(surface, edges, "not oriented", "that both faces have in the same direction")
    vertices = measures.nonmanifold_vertices(faces)[:, None]
    _refuse(surface, vertices, "not manifold", "where its parts touch only in a point")
    _check_one_piece(surface)
    if not measures.volume(surface) > FLAT * measures.face_areas(surface).sum() * measures.diagonal(
        surface
    ):
        needed = "which must be positive (faces counter-clockwise seen from outside)"
        volume = f"its volume is {measures.volume(surface):.3g}, {needed}"
        raise InputError(f"the surface encloses no volume: {volume}")


def _refuse(surface: TriMesh, wrong: np.ndarray, what: str, which: str) -> None:
    """Raise InputError if there are defective vertices (N, 1) or edges (N, 2)."""
    if len(wrong):
        names = ("vertex", "edge") if len(wrong) == 1 else ("vertices", "edges")
        ends = [measures.place(surface, surface.vertices[vertex]) for vertex in wrong[0]]
        where = f"at {ends[0]}" if len(ends) == 1 else f"from {ends[0]} to {ends[1]}"
        items = f"{len(wrong)} {names[wrong.shape[1] - 1]}"
        raise InputError(f"the surface is {what}: {items} {which}, the first {where}")


def _check_one_piece(surface: TriMesh) -> None:
    piece = measures.components(surface.faces)
    sizes = np.bincount(piece)
    if len(sizes) == 1:
        return
    shells = [surface.faces[piece == p] for p in range(len(sizes))]
    spans = [np.ptp(surface.vertices[shell.ravel()], axis=0).sum() for shell in shells]
    inner, outer = np.argsort(spans)[-2:]
    probes = surface.vertices[shells[inner][:: len(shells[inner]) // 8 + 1, 0]]
    if (abs(winding_numbers(TriMesh(surface.vertices, shells[outer]), probes)) > 0.5).all():
        inside = f"its piece of {sizes[inner]} faces at {measures.place(surface, probes[0])}"
        what = f"the solid has an inner void: {inside} lies inside another"
        raise InputError(what, remedy="give a solid without voids")
    smallest = int(np.argmin(sizes))
    place = measures.place(surface, surface.vertices[shells[smallest][0, 0]])
    least = f"the smallest of {sizes[smallest]} faces at {place}"
    what = f"the surface has {len(sizes)} separate pieces, {least}"
    raise InputError(what, remedy="give one solid")
