"""Lattice planes of one axis: on the planar faces of the part, evenly spaced between them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from polycube.surface.measures import face_areas, face_normals
from polycube.types import TriMesh

ALONG = np.cos(np.radians(2))  # of a normal and the axis that its plane is perpendicular to
SAME = 0.05  # of a cell: planes nearer than this are one
NEAREST = 0.6  # of a block: the least distance of two planes
MIDDLE = 0.2  # of a block: how far the plane between two may be from the middle
LEAST = 0.25  # of the area of a cell's side that a plane has at least


def planes(surface: TriMesh, axis: int, size: float, doublings: int = 1) -> np.ndarray:
    """Coordinates of the lattice planes perpendicular to an axis.

    Every second plane bounds blocks of two cells, every fourth blocks of four, and so on.  Planar
    faces have a plane between the largest blocks each, the larger first, where no other is near,
    or else one between smaller blocks.

    Parameters
    ----------
    surface : in the frame of the lattice
    size : wanted distance of two planes
    doublings : the largest blocks have so many levels of smaller ones and cells

    Returns
    -------
    (2^doublings N + 1,) ascending, from the lowest point of the surface to the highest
    """
    heights = surface.vertices[:, axis]
    kept = [float(heights.min()), float(heights.max())]
    places, areas = _faces(surface, axis, SAME * size)
    wide, order = 2**doublings * size, np.argsort(-areas, kind="stable")
    order = order[areas[order] >= LEAST * size**2]
    for number in order:
        gap = min(abs(places[number] - other) for other in kept)
        if gap >= NEAREST * wide:
            kept.append(float(places[number]))
    kept.sort()
    parts = [max(1, round((b - a) / wide)) for a, b in pairwise(kept)]
    ends = zip(pairwise(kept), parts, strict=True)
    blocks = [np.linspace(a, b, n, endpoint=False) for (a, b), n in ends]
    lines = np.concatenate([*blocks, kept[-1:]])
    for _ in range(doublings):
        lines = _halved(lines, places[order])
    return lines


def _halved(lines: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Lines (N,) with one more between two each: in the middle, or on the first place near that."""
    between = (lines[1:] + lines[:-1]) / 2
    for place in places[::-1]:
        block = np.searchsorted(lines, place) - 1
        if 0 <= block < len(between):
            share = (place - lines[block]) / (lines[block + 1] - lines[block])
            if abs(share - 0.5) < MIDDLE:
                between[block] = place
    return np.sort(np.concatenate([lines, between]))


def _faces(surface: TriMesh, axis: int, near: float) -> tuple[np.ndarray, np.ndarray]:
    """Heights and areas of the planes perpendicular to the axis."""
    flat = abs(face_normals(surface)[:, axis]) > ALONG
    height = surface.vertices[surface.faces[flat], axis].mean(axis=1)
    area = face_areas(surface)[flat]
    order = np.argsort(height)
    height, area = height[order], area[order]
    group = np.cumsum(np.append(0, np.diff(height) > near)) if len(height) else np.zeros(0, int)
    total = np.bincount(group, area)
    return np.bincount(group, area * height) / np.maximum(total, 1e-300), total
